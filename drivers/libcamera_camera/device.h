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

/// What libcamera's thread tells the program's. Its slots hold it, so that it outlives a call that is under way.
struct Told {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_gone = false;
  std::deque<lc::Request*> completed;
  std::size_t queued = 0;                        ///< requests in libcamera's hands
  std::chrono::steady_clock::time_point last{};  ///< when one came back
};

/// One running manager for whoever needs one: libcamera allows no second in a program.
class Manager {
 public:
  /// Errors: kUnavailable.
  static Result<std::shared_ptr<Manager>> use();
  ~Manager();
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  [[nodiscard]] std::vector<std::shared_ptr<lc::Camera>> cameras() const;

 private:
  Manager() = default;
};

/// A camera that is this program's.
class Device {
 public:
  /// @param name id or model
  /// Errors: kNotFound, kRefused, kDisconnected, kUnavailable.
  static Result<std::shared_ptr<Device>> open(const std::string& name);
  /// Its stream has been stopped.
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const std::shared_ptr<lc::Camera>& camera() const { return camera_; }
  [[nodiscard]] const std::shared_ptr<Told>& told() const { return told_; }
  [[nodiscard]] bool is_gone() const;
  /// Whether the camera still can be asked for what it offers: for when it is silent, of which libcamera tells nothing.
  [[nodiscard]] bool answers() const;

 private:
  Device(std::shared_ptr<Manager> manager, std::shared_ptr<lc::Camera> camera);

  const std::shared_ptr<Manager> manager_;
  std::shared_ptr<lc::Camera> camera_;
  const std::shared_ptr<Told> told_ = std::make_shared<Told>();
};

/// Those of kFormats that it has, each with its largest size: "NV12 up to 1920x1080".
std::vector<std::string> formats_of(lc::Camera& camera);

}  // namespace twocone::libcamera_camera
