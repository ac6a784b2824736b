// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/behaviours/behaviour.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/track.h"
#include "apps/runs/loop/frame_taker.h"
#include "apps/runs/remote_control.h"

namespace twocone::runs {

/// Decides the wheels' speeds for each frame by a behaviour, which receives the believed pose. Applies the dead-man
/// rule to the age of the images.
class Steering {
 public:
  /// @param behaviour wander, waypoints, explore, still, manual or controller. @throws std::invalid_argument for any
  /// other name, for manual without `remote`, and for controller without `controller`; config::FileError for waypoints
  /// if the robot file has no list of them, and for explore if the mirrors do not both see the floor
  /// @param remote holds the wheels; may be null
  Steering(const config::Robot& robot, const config::Map& map, const std::string& behaviour, std::uint64_t seed,
           const RemoteControl* remote, const behaviours::Controlled::Decide& controller,
           std::function<void(const std::string&)> notify);

  void add_odometry(std::uint64_t frame, const localisation::Pose& pose) { belief_.add_odometry(frame, pose); }
  /// Adds the position of a fix that can be used as a place.
  void add_fix(std::uint64_t frame, const Eigen::Vector2d& position_m) { belief_.add_fix(frame, position_m); }
  /// Adds what the robot saw around itself at a frame, with the estimate of its pose then, if there is one.
  void add_scan(std::uint64_t frame, const std::optional<Pose2>& estimate, const std::vector<vision::Beam>& scan);
  /// Replaces the obstacles that were found on the way.
  void avoid(const std::vector<Disc>& found) { behaviour_->avoid(found); }
  /// Returns the speeds for a frame. They are 0 while a person holds the wheels, and if the newest image is older than
  /// command_timeout_s. The loss of a camera thus stops the wheels within that time, too, however long the work on its
  /// last image takes.
  /// @param image_age_s age of the newest image, or the time of the work on the image before it, if that is longer
  [[nodiscard]] WheelSpeeds decide(std::uint64_t frame, double step_s, double image_age_s);

 private:
  localisation::WheelGeometry wheels_;
  double command_timeout_s_;
  const RemoteControl* remote_;
  std::function<void(const std::string&)> notify_;
  std::unique_ptr<behaviours::Behaviour> behaviour_;
  estimation::BelievedPose belief_;
  bool was_late_ = false;
  bool was_held_ = false;
};

}  // namespace twocone::runs
