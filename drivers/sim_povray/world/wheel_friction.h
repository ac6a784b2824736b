// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {

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

/// Returns the impulse of the wheels' friction in `dt_s` on a body with the velocity `before`: of all impulses P_l, P_r
/// (along and across each wheel) within the circle |P| <= most_N dt, those that minimise the kinetic energy of sliding
/// against the rims,
///     1/2 P' A P + P' c,   c: the contact points' velocities against the rims before, A: change of c by an impulse.
/// Solved in closed form if both wheels grip, else by accelerated projected gradient steps (Nesterov's, restarted where
/// they go uphill) down to 1e-12 of the greatest impulse, 1000 at most. The result is within 1e-6 of the greatest
/// impulse of the true minimum, for separations from half to twenty times the body's radius (physics_test.cpp,
/// WheelImpulsesMinimiseSliding and WheelImpulsesMeetTheConditionsOfTheMinimum).
FloorImpulse wheel_impulse(const WheelFriction& wheels, const FloorVelocity& before, const GroundSpeeds& rims,
                           double dt_s);

}  // namespace twocone::sim_povray
