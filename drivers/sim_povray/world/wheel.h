// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>

#include "drivers/sim_povray/world/motion.h"

/// The wheels of a robot: their rotation, their slip and their friction.
namespace twocone::sim_povray {

/// Rotation of one wheel over one step. Its command is u until `driven_s` and 0 from then on. The wheel follows
/// immediately or with a first-order lag, w' = (u - w) / lag:
///     w(t) = u + (w0 - u) e^(-t/lag),   angle(t) = u t + (w0 - u) lag (1 - e^(-t/lag)),
/// in each of the two parts. The equations are exact for any length.
struct WheelCourse {
  double begin_radps = 0;    ///< w0; not used without lag
  double command_radps = 0;  ///< u
  double driven_s = 0;       ///< >= 0
  double lag_s = 0;          ///< >= 0

  /// Returns the angle turned since the beginning of the step.
  [[nodiscard]] double turned_rad(double time_s) const;
  /// Returns the speed. With lag, it reaches the command when it is within 1e-12 rad/s, so that a wheel does stop.
  [[nodiscard]] double speed_radps(double time_s) const;
};

/// Purposes of a robot's random engines. Each has an engine of its own, so that switching one effect on or off does not
/// change the draws of the others. The numbers are part of the seed and must not change.
enum class Purpose : std::uint32_t { kLeftSlip = 1, kRightSlip = 2 };

std::mt19937_64 engine_for(std::uint64_t seed, Purpose purpose);

/// Relative slip of one wheel: a first-order Gauss-Markov process of stationary standard deviation sigma,
///     s' = a s + sigma sqrt(1 - a^2) n,   a = exp(-dt / tau),   n ~ N(0, 1),
/// started from its stationary distribution. With sigma = 0 it draws nothing and is 0.
class Slip {
 public:
  Slip(double sigma, double correlation_s, std::mt19937_64 engine);
  [[nodiscard]] double value() const { return value_; }
  void advance(double dt_s);

 private:
  double sigma_;
  double correlation_s_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  double value_ = 0;
};

/// A disc on two wheels, each of which has a friction force of at most `most_N` on the floor.
struct WheelFriction {
  double mass_kg = 1;
  double inertia_kgm2 = 1;
  double separation_m = 1;
  double most_N = 0;
};

/// Velocity over the floor, in the body's frame.
struct FloorVelocity {
  double ahead_mps = 0;
  double left_mps = 0;
  double turn_radps = 0;
};
struct FloorImpulse {
  double ahead_Ns = 0;
  double left_Ns = 0;
  double turn_Nms = 0;
};

/// Returns the impulse of the wheels' friction in `dt_s` on a body with the velocity `before`. Of all impulses P_l, P_r
/// (along and across each wheel) within the circle |P| <= most_N dt, it minimises the kinetic energy of sliding against
/// the rims,
///     1/2 P' A P + P' c,   c: the contact points' velocities against the rims before, A: change of c by an impulse.
/// The solution has a closed form if both wheels grip; otherwise accelerated projected gradient steps (Nesterov's,
/// restarted where they go uphill) lead to it, down to 1e-12 of the greatest impulse, 1000 at most. The result is
/// within 1e-6 of the greatest impulse of the true minimum, for separations from half to twenty times the body's radius
/// (wheels_test.cpp, WheelImpulsesMinimiseSliding and WheelImpulsesMeetTheConditionsOfTheMinimum).
FloorImpulse wheel_impulse(const WheelFriction& wheels, const FloorVelocity& before, const GroundSpeeds& rims,
                           double dt_s);

}  // namespace twocone::sim_povray
