// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Geometry>

#include "base/plane.h"

namespace twocone::localisation {

/// The pose of the body. Headings are wrapped by wrap_angle_rad().
using Pose = Pose2;
using base::wrap_angle_rad;

/// Converts a point from the world frame to the frame of a body at `pose`.
inline Eigen::Vector2d in_body(const Pose& pose, const Eigen::Vector2d& place_m) {
  return Eigen::Rotation2Dd(-pose.heading_rad) * (place_m - Eigen::Vector2d(pose.x_m, pose.y_m));
}

/// Returns `pose` after the wheels' contact points have moved by `left_m` and `right_m` along one exact arc (class
/// Odometry), with `separation_m` between them, > 0. The result is not finite where the distance exceeds the range of
/// doubles.
/// @throws std::invalid_argument for another separation
Pose drive_arc(const Pose& pose, double left_m, double right_m, double separation_m);

/// Returns sin(x) / x, accurate to rounding for every x.
double sinc(double x);

struct WheelGeometry {
  double radius_m = 0;      ///< > 0
  double separation_m = 0;  ///< between the contact points, > 0
};

/// The angles by which both wheels turn.
struct WheelTurns {
  double left_rad = 0;
  double right_rad = 0;
};
/// Computes the inverse kinematics, left = (arc - turn b / 2) / r and right = (arc + turn b / 2) / r: the inverse of D
/// and T of Odometry. It is linear, so speeds (m/s, rad/s) give speeds (rad/s).
WheelTurns wheel_turns(const WheelGeometry& wheels, double arc_m, double turn_rad);

/// Returns the body's mean velocity while the wheels turn by `turned` in `time_s`, > 0. It inverts wheel_turns().
BodyTwist twist_of(const WheelGeometry& wheels, const WheelTurns& turned, double time_s);

/// Dead reckoning from the wheels: the pose from the angles alone, without slip.
///
/// Between two readings the robot is assumed to drive one exact arc of length D = r (dl + dr) / 2 and turn
/// T = r (dr - dl) / b:
///
///     x += D sinc(T/2) cos(heading + T/2),   y += D sinc(T/2) sin(heading + T/2),   heading += T,
///
/// which loses no digit near T = 0, unlike the textbook's v/w form. (The simulated world has its own arc on purpose:
/// the truth must not share code with the belief that is compared with it. A test compares both with 50-digit values.)
class Odometry {
 public:
  /// @throws std::invalid_argument naming every bad field
  Odometry(const WheelGeometry& wheels, const Pose& start);

  /// Updates the pose by the wheels' total angles and returns it; the first call only sets the zero.
  /// @throws std::invalid_argument for angles that are not finite and a distance beyond the range of doubles
  const Pose& update(double left_rad, double right_rad);

  [[nodiscard]] const Pose& pose() const { return pose_; }

 private:
  WheelGeometry wheels_;
  Pose pose_;
  std::optional<WheelTurns> last_;  ///< the wheels' total angles of the last update
};

}  // namespace twocone::localisation
