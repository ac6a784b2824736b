// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "base/plane.h"

/// Planar rigid motion, exact for speeds that are constant over a step.
namespace twocone::sim_povray {

inline double seconds(std::chrono::nanoseconds span) { return std::chrono::duration<double>(span).count(); }

/// Returns the same direction in (-pi, pi]; an angle within [-pi, pi] in double precision is returned unchanged. The
/// result is within a few ulp of the true remainder for |angle_rad| <= 1e6, because sin and cos reduce by the real pi,
/// not by the double nearest to it.
/// @throws std::invalid_argument for an angle that is not finite
double wrap_angle(double angle_rad);
/// Returns the same pose with its heading wrapped.
Pose2 wrapped(const Pose2& pose);

/// Speeds of the two wheels' contact points over the floor.
struct GroundSpeeds {
  double left_mps = 0;
  double right_mps = 0;
};

/// Velocity of a body: along its x axis, and counter-clockwise.
struct BodySpeeds {
  double speed_mps = 0;
  double turn_radps = 0;
};

/// Returns the velocity of the body whose wheels have these speeds. @param separation_m between the contact points, > 0
/// @throws std::invalid_argument naming every argument that is not finite or out of its domain
BodySpeeds body_speeds(const GroundSpeeds& wheels, double separation_m);

/// Returns the pose of a body after `dt_s` at constant speeds: on an arc of length d = v dt that turns by a = w dt,
/// whose chord is d sin(a/2) / (a/2) long and points along heading + a/2. Unlike the textbook form with v/w, this holds
/// at w = 0 and loses no accuracy near it (tests/sim_povray/motion_test.cpp, hard cases).
/// @param dt_s > 0
/// @throws std::invalid_argument naming every argument that is not finite or out of its domain
Pose2 advance(const Pose2& from, const BodySpeeds& speeds, double dt_s);

/// A rigid motion of the world's points over the floor: p' = R p + t.
struct FloorMotion {
  double cos_turn = 1;
  double sin_turn = 0;
  double x_m = 0;
  double y_m = 0;
};

/// Returns the motion X_now X_start^-1, which carries a body at `start` to `now`; exactly the identity if they are
/// equal.
FloorMotion motion_between(const Pose2& start, const Pose2& now);

}  // namespace twocone::sim_povray
