// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/diff_drive.h"
#include "hal/named_camera.h"
#include "hal/pose.h"
#include "hal/stereo_rig.h"

namespace twocone {

/// Where the robot really is. A simulation offers it, hardware does not. For records and reports; no behaviour asks.
class GroundTruth {
 public:
  virtual ~GroundTruth() = default;
  /// The true pose at the instant of the newest frame.
  [[nodiscard]] virtual Pose2 true_pose() const = 0;
  /// What the robot's body touches at that instant, as a person would call it: "wall", "landmark red". Empty: nothing.
  [[nodiscard]] virtual std::string contact() const { return {}; }
};

/// The whole robot, made from opened devices. Start here to write a controller (examples/controller).
///
/// `next_frame` is the only step: a simulated world advances by one frame period and stands still otherwise; on
/// hardware the call waits for the next pair. One thread at a time.
///
/// A robot may have more cameras than the pair. Each of them is grabbed once after every pair: in simulation it shows
/// the pair's instant, on hardware its newest exposure; its frame says when that was.
class Robot {
 public:
  /// @param truth may be null
  /// @param others cameras besides the pair, in the order in which they are started and grabbed
  /// @throws std::invalid_argument for a missing drive; naming every camera of `others` that is missing or whose name
  /// is empty, `lower`, `upper` or used twice
  Robot(StereoRig cameras, std::unique_ptr<DiffDrive> drive, std::unique_ptr<GroundTruth> truth,
        std::vector<NamedCamera> others = {});
  Robot(Robot&&) noexcept = default;
  Robot& operator=(Robot&&) = delete;
  ~Robot();

  /// Starts the pair, then the others with their own settings; if one does not start, none is left running.
  /// Errors: those of StereoRig::start and start_camera.
  Status start(const CameraSettings& lower, const CameraSettings& upper);

  /// The next pair, for which and for the other cameras' frames together `timeout` is the limit. What has come when a
  /// later camera fails is kept for the next call, so that trying again loses no frame and moves no world.
  /// Errors: those of StereoRig::grab; those of Camera::grab with the camera's name before them.
  Result<StereoFrame> next_frame(std::chrono::milliseconds timeout);

  /// What the other cameras saw with the newest pair, in the order of the constructor; empty before it.
  [[nodiscard]] const std::vector<NamedFrame>& other_frames() const { return other_frames_; }

  [[nodiscard]] DiffDrive& drive() { return *drive_; }
  [[nodiscard]] const StereoRig& cameras() const { return cameras_; }

  /// Where the robot really was at the newest frame; nothing on hardware.
  [[nodiscard]] std::optional<Pose2> true_pose() const;
  /// What its body touched at the newest frame; empty if nothing, and on hardware.
  [[nodiscard]] std::string contact() const;

  /// Stops the wheels first, then the cameras.
  void stop() noexcept;

 private:
  Status start_others();
  void stop_cameras() noexcept;

  StereoRig cameras_;
  std::unique_ptr<DiffDrive> drive_;
  std::unique_ptr<GroundTruth> truth_;
  std::vector<NamedCamera> others_;
  std::vector<NamedFrame> other_frames_;
  // Of an instant whose frames have not all come.
  std::optional<StereoFrame> waiting_pair_;
  std::vector<NamedFrame> waiting_others_;
};

}  // namespace twocone
