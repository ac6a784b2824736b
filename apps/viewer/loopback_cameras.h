// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim_povray/simulation_host.h"
#include "drivers/v4l2_camera/loopback.h"
#include "hal/result.h"

namespace twocone::viewer {

/// Passes what cameras in a served world see to devices of v4l2loopback, so that any program captures it. Images are
/// written in their order, as soon as they are rendered; the world waits for none.
class LoopbackCameras {
 public:
  struct Wanted {
    std::string camera;  ///< with its robot's name, robot.2.lower, or lower: that of the first robot that has one
    std::string device;  ///< /dev/video10
  };
  /// Errors: those of v4l2::open_loopback.
  /// @param report receives one line when a device does not accept an image; from several threads, one at a time
  static Result<std::unique_ptr<LoopbackCameras>> open(const std::vector<Wanted>& wanted,
                                                       std::function<void(const std::string&)> report);
  ~LoopbackCameras();
  LoopbackCameras(const LoopbackCameras&) = delete;
  LoopbackCameras& operator=(const LoopbackCameras&) = delete;

  /// Takes an image that was ordered (WorldWatch::ordered).
  void ordered(const std::string& robot, const std::string& camera, const std::shared_future<ImageResult>& image);

 private:
  struct Output {
    std::string camera;
    std::unique_ptr<v4l2::LoopbackDevice> device;
    std::deque<std::shared_future<ImageResult>> waiting{};
    std::thread thread{};
  };
  explicit LoopbackCameras(std::function<void(const std::string&)> report) : report_(std::move(report)) {}
  void write(Output& output);

  std::function<void(const std::string&)> report_;
  std::mutex mutex_;  // protects is_ending_, all `waiting`, and calls of report_
  std::condition_variable changed_;
  bool is_ending_ = false;
  std::vector<std::unique_ptr<Output>> outputs_;
};

}  // namespace twocone::viewer
