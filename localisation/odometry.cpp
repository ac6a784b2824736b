// SPDX-License-Identifier: Apache-2.0
#include "localisation/odometry.h"

#include <cmath>

#include "base/errors.h"

namespace twocone::localisation {

// The slope of sinc at 0 is 0, so the quotient is exact to rounding for every x except 0.
double sinc(double x) { return x == 0 ? 1 : std::sin(x) / x; }

Pose drive_arc(const Pose& pose, double left_m, double right_m, double separation_m) {
  if (!(separation_m > 0) || !std::isfinite(separation_m)) {
    throw base::InvalidArgument("drive_arc: separation_m is {}, must be > 0 m", separation_m);
  }
  const double turn_rad = (right_m - left_m) / separation_m;
  const double chord_m = (left_m + right_m) / 2 * sinc(turn_rad / 2);
  const double course_rad = pose.heading_rad + turn_rad / 2;
  return {pose.x_m + chord_m * std::cos(course_rad), pose.y_m + chord_m * std::sin(course_rad),
          wrap_angle_rad(pose.heading_rad + turn_rad)};
}

Odometry::Odometry(const WheelGeometry& wheels, const Pose& start) : wheels_(wheels), pose_(start) {
  base::Complaints bad;
  bad.require_field(base::is_positive(wheels.radius_m), "radius_m", wheels.radius_m, "> 0 m");
  bad.require_field(base::is_positive(wheels.separation_m), "separation_m", wheels.separation_m, "> 0 m");
  bad.require_field(std::isfinite(start.x_m), "start.x_m", start.x_m, "a finite number of m");
  bad.require_field(std::isfinite(start.y_m), "start.y_m", start.y_m, "a finite number of m");
  bad.require_field(std::isfinite(start.heading_rad), "start.heading_rad", start.heading_rad, "a finite number of rad");
  bad.raise("Odometry");
  pose_.heading_rad = wrap_angle_rad(start.heading_rad);
}

const Pose& Odometry::update(double left_rad, double right_rad) {
  if (!std::isfinite(left_rad) || !std::isfinite(right_rad)) {
    throw base::InvalidArgument("Odometry::update: left {} rad, right {} rad: must be finite", left_rad, right_rad);
  }
  if (last_) {
    const Pose next = drive_arc(pose_, wheels_.radius_m * (left_rad - last_->left_rad),
                                wheels_.radius_m * (right_rad - last_->right_rad), wheels_.separation_m);
    if (!std::isfinite(next.x_m) || !std::isfinite(next.y_m) || !std::isfinite(next.heading_rad)) {
      throw base::InvalidArgument(
          "Odometry::update: from left {} rad, right {} rad to {} rad, {} rad exceeds the range of numbers",
          last_->left_rad, last_->right_rad, left_rad, right_rad);
    }
    pose_ = next;
  }
  last_ = {left_rad, right_rad};
  return pose_;
}

WheelTurns wheel_turns(const WheelGeometry& wheels, double arc_m, double turn_rad) {
  const double half_m = turn_rad * wheels.separation_m / 2;
  return {(arc_m - half_m) / wheels.radius_m, (arc_m + half_m) / wheels.radius_m};
}

BodyTwist twist_of(const WheelGeometry& wheels, const WheelTurns& turned, double time_s) {
  const double left_mps = wheels.radius_m * turned.left_rad / time_s;
  const double right_mps = wheels.radius_m * turned.right_rad / time_s;
  return {(left_mps + right_mps) / 2, (right_mps - left_mps) / wheels.separation_m};
}

}  // namespace twocone::localisation
