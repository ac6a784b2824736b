// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/plane.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/stereo_rig.h"

namespace twocone {

/// A camera that a robot has in addition to its pair.
struct NamedCamera {
  std::string name;  ///< the key in the robot file's `cameras:`; neither empty nor `lower` nor `upper`
  std::unique_ptr<Camera> camera;
  CameraSettings settings;  ///< requested by Robot::start
};

/// A frame of such a camera.
struct NamedFrame {
  std::string name;
  Frame frame;
};

/// The robot's true pose. A simulation offers it, hardware does not. It is for records and reports; no behaviour uses
/// it.
class GroundTruth {
 public:
  virtual ~GroundTruth() = default;
  /// Returns the true pose at the time of the newest frame.
  [[nodiscard]] virtual Pose2 true_pose() const = 0;
  /// Returns the name, for a person, of the object that the robot's body touches at that time: "wall", "landmark red".
  /// Empty: none.
  [[nodiscard]] virtual std::string contact() const { return {}; }
};

/// The pace of the robot's time, as its drivers report it. A control loop takes its timeouts from this.
struct RobotPace {
  /// The world is stopped between calls of next_frame(), however long the program takes: no image becomes outdated, and
  /// a part that fails does not recover by itself. True in simulation.
  bool waits_for_program = false;
  /// A pair that takes longer is a fault. Zero: four periods of the slower camera's applied rate, at least one second.
  std::chrono::milliseconds frame_timeout{0};
  std::string notice{};  ///< what a person should know before the first frame; empty: nothing
};

/// The whole robot, made from opened devices. Start here to write a controller (examples/controller).
///
/// Only `next_frame` advances time: a simulated world advances by one frame period and is stopped otherwise; on
/// hardware the call waits for the next pair. A robot must be used by one thread at a time.
///
/// A robot may have more cameras than the pair. Each of them is grabbed once after every pair. In simulation its frame
/// shows the same moment as the pair; on hardware it is the camera's newest one. The frame's header holds its time.
class Robot {
 public:
  /// @param truth may be null
  /// @param others cameras in addition to the pair, in the order in which they are started and grabbed
  /// @throws std::invalid_argument for a missing drive, or naming every camera of `others` that is missing or whose
  /// name is empty, `lower`, `upper` or used twice
  Robot(StereoRig cameras, std::unique_ptr<DiffDrive> drive, std::unique_ptr<GroundTruth> truth,
        std::vector<NamedCamera> others = {}, RobotPace pace = {});
  Robot(Robot&&) noexcept = default;
  Robot& operator=(Robot&&) = delete;
  ~Robot();

  /// Starts the pair, then the others with their own settings. If one does not start, all are stopped.
  /// Errors: those of StereoRig::start and start_camera.
  Status start(const CameraSettings& lower, const CameraSettings& upper);

  /// Returns the next pair. `timeout` limits the wait for the pair and the other cameras' frames together. If a later
  /// camera fails, the frames that have arrived are kept for the next call. Trying again then loses no frame and does
  /// not advance the simulated world.
  /// Errors: those of StereoRig::grab; those of Camera::grab with the camera's name before them.
  Result<StereoFrame> next_frame(std::chrono::milliseconds timeout);

  /// Returns the other cameras' frames that belong to the newest pair, in the order of the constructor; empty before
  /// the first pair.
  [[nodiscard]] const std::vector<NamedFrame>& other_frames() const { return other_frames_; }

  /// Returns the pace; its frame_timeout follows from the cameras' applied rates, which are known after start().
  [[nodiscard]] RobotPace pace() const;
  [[nodiscard]] DiffDrive& drive() { return *drive_; }
  [[nodiscard]] const StereoRig& cameras() const { return cameras_; }

  /// Returns the true pose at the newest frame; nothing on hardware.
  [[nodiscard]] std::optional<Pose2> true_pose() const;
  /// Returns the object that the robot's body touched at the newest frame; empty if none, and on hardware.
  [[nodiscard]] std::string contact() const;

  /// Stops the wheels first, then the cameras.
  void stop() noexcept;

 private:
  void stop_cameras() noexcept;

  StereoRig cameras_;
  std::unique_ptr<DiffDrive> drive_;
  std::unique_ptr<GroundTruth> truth_;
  std::vector<NamedCamera> others_;
  RobotPace pace_;
  std::vector<NamedFrame> other_frames_;
  // Frames of a call of next_frame() in which a camera failed; the next call uses them.
  std::optional<StereoFrame> waiting_pair_;
  std::vector<NamedFrame> waiting_others_;
};

}  // namespace twocone
