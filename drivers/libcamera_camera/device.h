// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/libcamera_camera/interface.h"
#include "hal/result.h"

namespace twocone::libcamera_camera {

/// State that libcamera's thread reports to the program's thread. libcamera's slots hold it, so that it outlives a call
/// in progress.
struct SharedState {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_gone = false;
  std::deque<lc::Request*> completed;
  std::size_t queued = 0;                        ///< requests that libcamera has
  std::chrono::steady_clock::time_point last{};  ///< time of the last completed request
};

/// The one running manager, shared by all users: libcamera allows no second one in a program. Errors: kUnavailable.
Result<std::shared_ptr<lc::CameraManager>> use_manager();

/// A camera that this program has acquired.
class Device {
 public:
  /// @param name id or model
  /// Errors: kNotFound, kRefused, kDisconnected, kUnavailable.
  static Result<std::shared_ptr<Device>> open(const std::string& name);
  /// The stream must be stopped before.
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const std::shared_ptr<lc::Camera>& camera() const { return camera_; }
  [[nodiscard]] const std::shared_ptr<SharedState>& shared() const { return shared_; }
  [[nodiscard]] bool is_gone() const;
  /// Returns whether the camera still answers a query for its formats. This is for a camera that sends nothing, which
  /// libcamera does not report.
  [[nodiscard]] bool answers() const;

 private:
  Device(std::shared_ptr<lc::CameraManager> manager, std::shared_ptr<lc::Camera> camera);

  const std::shared_ptr<lc::CameraManager> manager_;
  std::shared_ptr<lc::Camera> camera_;
  const std::shared_ptr<SharedState> shared_ = std::make_shared<SharedState>();
};

/// The formats of kCameraFormats that the camera has, each with its largest size: "NV12 up to 1920x1080".
std::vector<std::string> formats_of(lc::Camera& camera);

}  // namespace twocone::libcamera_camera
