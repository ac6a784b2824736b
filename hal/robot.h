// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "hal/diff_drive.h"
#include "hal/pose.h"
#include "hal/stereo_rig.h"

namespace twocone {

/// Where the robot really is. A simulation offers it, hardware does not. For records and reports; no behaviour asks.
class GroundTruth {
 public:
  virtual ~GroundTruth() = default;
  /// The true pose at the instant of the newest frame.
  [[nodiscard]] virtual Pose2 true_pose() const = 0;
};

/// The whole robot, made from opened devices. Start here to write a controller (examples/controller).
///
/// `next_frame` is the only step: a simulated world advances by one frame period and stands still otherwise; on
/// hardware the call waits for the next pair. One thread at a time.
class Robot {
 public:
  /// @param truth may be null. @throws std::invalid_argument for a missing drive
  Robot(StereoRig cameras, std::unique_ptr<DiffDrive> drive, std::unique_ptr<GroundTruth> truth);
  Robot(Robot&&) noexcept = default;
  Robot& operator=(Robot&&) = delete;
  ~Robot();

  /// Starts both cameras. Errors: those of StereoRig::start.
  Status start(const CameraSettings& lower, const CameraSettings& upper);

  /// Errors: those of StereoRig::grab.
  Result<StereoFrame> next_frame(std::chrono::milliseconds timeout);

  [[nodiscard]] DiffDrive& drive() { return *drive_; }
  [[nodiscard]] const StereoRig& cameras() const { return cameras_; }

  /// Where the robot really was at the newest frame; nothing on hardware.
  [[nodiscard]] std::optional<Pose2> true_pose() const;

  /// Stops the wheels first, then the cameras.
  void stop() noexcept;

 private:
  StereoRig cameras_;
  std::unique_ptr<DiffDrive> drive_;
  std::unique_ptr<GroundTruth> truth_;
};

}  // namespace twocone
