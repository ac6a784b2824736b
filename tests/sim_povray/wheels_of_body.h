// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/diff_drive.h"

namespace twocone::sim_povray {

inline constexpr double kRadius_m = 0.2;
inline constexpr double kWheel_m = 0.05;

/// Returns the wheel speeds of a body that drives at `speed_mps` and turns at `turn_radps`; its wheels are 0.3 m apart.
inline WheelSpeeds wheels(double speed_mps, double turn_radps = 0) {
  return {(speed_mps - turn_radps * 0.15) / kWheel_m, (speed_mps + turn_radps * 0.15) / kWheel_m};
}

}  // namespace twocone::sim_povray
