// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/robot.h"
#include "hal/stereo_rig.h"

/// Devices that follow a test's script and record the calls they receive. They are for tests of the code that uses
/// devices.
namespace twocone::test {

/// The calls in order, such as "lower.start"; it outlives the devices.
using Log = std::vector<std::string>;

inline Image small_image(std::uint8_t grey = 7) { return {2, 1, PixelFormat::kGrey8, {grey, grey}}; }

inline Frame frame_at(std::uint64_t sequence, std::chrono::nanoseconds time) {
  return {Frame::Header{sequence, {ClockKind::kSimulated, time}, 0}, small_image()};
}

class ScriptedCamera final : public Camera {
 public:
  /// The results of the calls; the test may change them at any time.
  struct Script {
    std::deque<Result<Frame>> grabs;  ///< in order; then kTimeout
    Status configured, started;
    CameraSettings smaller_by;  ///< subtracted from the wanted settings
    std::vector<std::chrono::milliseconds> timeouts;

    Script() { smaller_by = {0, 0, 0}; }
  };

  ScriptedCamera(std::string name, std::shared_ptr<Script> script, std::shared_ptr<Log> log)
      : name_(std::move(name)), script_(std::move(script)), log_(std::move(log)) {}
  ~ScriptedCamera() override { stop(); }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    log_->push_back(name_ + ".configure");
    if (!script_->configured) return script_->configured.error();
    return CameraSettings{wanted.width_px - script_->smaller_by.width_px,
                          wanted.height_px - script_->smaller_by.height_px,
                          wanted.rate_hz - script_->smaller_by.rate_hz};
  }
  Status do_start() override {
    log_->push_back(name_ + ".start");
    return script_->started;
  }
  Result<Frame> do_grab(std::chrono::milliseconds timeout) override {
    log_->push_back(name_ + ".grab");
    script_->timeouts.push_back(timeout);
    if (script_->grabs.empty()) return Error{ErrorCode::kTimeout, "the script is at its end"};
    auto next = std::move(script_->grabs.front());
    script_->grabs.pop_front();
    return next;
  }
  void do_stop() noexcept override { log_->push_back(name_ + ".stop"); }

  std::string name_;
  std::shared_ptr<Script> script_;
  std::shared_ptr<Log> log_;
};

/// Two cameras that follow scripts, and the calls that they receive; for a fixture to derive from.
struct ScriptedPair {
  [[nodiscard]] StereoRig make_rig(std::chrono::nanoseconds max_skew) const {
    return {std::make_unique<ScriptedCamera>("lower", lower_, log_),
            std::make_unique<ScriptedCamera>("upper", upper_, log_), max_skew};
  }

  std::shared_ptr<Log> log_ = std::make_shared<Log>();
  std::shared_ptr<ScriptedCamera::Script> lower_ = std::make_shared<ScriptedCamera::Script>();
  std::shared_ptr<ScriptedCamera::Script> upper_ = std::make_shared<ScriptedCamera::Script>();
};

class ScriptedDrive final : public DiffDrive {
 public:
  struct Script {
    Status answer;
    std::vector<WheelSpeeds> speeds;
  };

  ScriptedDrive(std::shared_ptr<Script> script, std::shared_ptr<Log> log, const DriveLimits& limits = {})
      : DiffDrive(limits), script_(std::move(script)), log_(std::move(log)) {}
  ~ScriptedDrive() override { log_->push_back("drive.gone"); }

 private:
  Status do_set_speeds(const WheelSpeeds& speeds) override {
    log_->push_back("drive.set_speeds");
    script_->speeds.push_back(speeds);
    return script_->answer;
  }
  Result<WheelAngles> do_read_angles() override {
    log_->push_back("drive.read_angles");
    if (!script_->answer) return script_->answer.error();
    return WheelAngles{{ClockKind::kSimulated, std::chrono::seconds(3)}, 1.25, -0.75};
  }
  Status do_stop() noexcept override {
    log_->push_back("drive.stop");
    return script_->answer;
  }

  std::shared_ptr<Script> script_;
  std::shared_ptr<Log> log_;
};

}  // namespace twocone::test
