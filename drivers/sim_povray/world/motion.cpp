// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/motion.h"

#include <cmath>
#include <numbers>

#include "base/errors.h"

namespace twocone::sim_povray {
double wrap_angle(double angle_rad) {
  if (!std::isfinite(angle_rad)) {
    throw base::InvalidArgument("wrap_angle: angle_rad is {} rad, must be finite", angle_rad);
  }
  if (std::abs(angle_rad) <= std::numbers::pi) return angle_rad;
  return std::atan2(std::sin(angle_rad), std::cos(angle_rad));
}

Pose2 wrapped(const Pose2& pose) { return {pose.x_m, pose.y_m, wrap_angle(pose.heading_rad)}; }

BodySpeeds body_speeds(const GroundSpeeds& wheels, double separation_m) {
  base::Complaints complaints;
  complaints.finite("left_mps", wheels.left_mps, "m/s");
  complaints.finite("right_mps", wheels.right_mps, "m/s");
  complaints.positive("separation_m", separation_m, "m");
  complaints.raise("body_speeds");
  return {wheels.left_mps / 2 + wheels.right_mps / 2, (wheels.right_mps - wheels.left_mps) / separation_m};
}

Pose2 advance(const Pose2& from, const BodySpeeds& speeds, double dt_s) {
  base::Complaints complaints;
  complaints.finite("x_m", from.x_m, "m");
  complaints.finite("y_m", from.y_m, "m");
  complaints.finite("heading_rad", from.heading_rad, "rad");
  complaints.finite("speed_mps", speeds.speed_mps, "m/s");
  complaints.finite("turn_radps", speeds.turn_radps, "rad/s");
  complaints.positive("dt_s", dt_s, "s");
  complaints.raise("advance");

  const double turn_rad = speeds.turn_radps * dt_s;
  const double half_rad = turn_rad / 2;
  // sin(a)/a is accurate to an ulp for every a except 0, because sin is, down to the smallest doubles.
  const double chord_m = speeds.speed_mps * dt_s * (half_rad == 0 ? 1 : std::sin(half_rad) / half_rad);
  return {from.x_m + chord_m * std::cos(from.heading_rad + half_rad),
          from.y_m + chord_m * std::sin(from.heading_rad + half_rad), wrap_angle(from.heading_rad + turn_rad)};
}

FloorMotion motion_between(const Pose2& start, const Pose2& now) {
  const double turn_rad = now.heading_rad - start.heading_rad;
  const double c = std::cos(turn_rad);
  const double s = std::sin(turn_rad);
  return {c, s, now.x_m - (c * start.x_m - s * start.y_m), now.y_m - (s * start.x_m + c * start.y_m)};
}

}  // namespace twocone::sim_povray
