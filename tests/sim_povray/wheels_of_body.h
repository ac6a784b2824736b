// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/world/world.h"
#include "hal/diff_drive.h"

namespace twocone::sim_povray {

inline constexpr double kRadius_m = 0.2;
inline constexpr double kWheel_m = 0.05;

/// Returns the wheel speeds of a body that drives at `speed_mps` and turns at `turn_radps`; its wheels are 0.3 m apart.
inline WheelSpeeds wheels(double speed_mps, double turn_radps = 0) {
  return {(speed_mps - turn_radps * 0.15) / kWheel_m, (speed_mps + turn_radps * 0.15) / kWheel_m};
}

inline RobotBody body_at(const Pose2& start) {
  return {.start = start, .radius_m = kRadius_m, .wheels = {.separation_m = 0.3, .radius_m = kWheel_m}};
}

/// Commands the same speeds at each step.
inline void drive(World& world, World::RobotId robot, const WheelSpeeds& speeds, int steps) {
  for (int i = 0; i < steps; ++i) {
    world.command(robot, speeds);
    world.step();
  }
}

inline World world_of(const PlaceSettings& place, double rate_hz = 15) {
  World world(place);
  world.set_rate(rate_hz);
  return world;
}

}  // namespace twocone::sim_povray
