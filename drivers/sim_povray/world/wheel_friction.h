// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {

/// A disc on two wheels, each of which holds the floor by at most `most_N`.
struct WheelFriction {
  double mass_kg = 1;
  double inertia_kgm2 = 1;
  double separation_m = 1;
  double most_N = 0;
};

/// In the body's frame.
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

/// What the wheels' friction does in `dt_s` to a body that moves so: of all impulses P_l, P_r (along and across each
/// wheel) within the circle |P| <= most_N dt, those that minimise the kinetic energy of sliding against the rims,
///     1/2 P' A P + P' c,   c: the contact points' velocities against the rims before, A: what an impulse changes of c.
/// In closed form if both wheels grip, else by accelerated projected gradient steps (Nesterov's, begun anew where they
/// go uphill) down to 1e-12 of the greatest impulse, 1000 at most: within 1e-6 of it of the true minimum, for
/// separations from half to twenty times the body's radius (physics_test.cpp, WheelImpulsesSlideLeast and
/// WheelImpulsesMeetTheConditionsOfTheMinimum).
FloorImpulse wheel_impulse(const WheelFriction& wheels, const FloorVelocity& before, const GroundSpeeds& rims,
                           double dt_s);

}  // namespace twocone::sim_povray
