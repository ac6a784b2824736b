// SPDX-License-Identifier: Apache-2.0
#include "hal/diff_drive.h"

#include <algorithm>
#include <cmath>

#include "base/errors.h"

namespace twocone {

void check(const DriveLimits& limits) {
  base::Complaints bad;
  bad.positive("max_speed_radps", limits.max_speed_radps, "rad/s");
  if (limits.command_timeout.count() <= 0) {
    bad.add("command_timeout is {} ns, must be > 0", limits.command_timeout.count());
  }
  bad.raise("DriveLimits");
}

DiffDrive::DiffDrive(const DriveLimits& limits) : limits_(limits) { check(limits); }

Result<WheelSpeeds> DiffDrive::set_speeds(const WheelSpeeds& wanted) {
  if (!std::isfinite(wanted.left_radps) || !std::isfinite(wanted.right_radps)) {
    throw base::InvalidArgument("DiffDrive::set_speeds: left {} rad/s, right {} rad/s: must be finite",
                                wanted.left_radps, wanted.right_radps);
  }
  const double fastest = std::max(std::abs(wanted.left_radps), std::abs(wanted.right_radps));
  WheelSpeeds applied = wanted;
  if (fastest > limits_.max_speed_radps) {
    // Each wheel is scaled by its ratio to the faster one: a factor max/fastest would underflow for huge speeds.
    applied = {limits_.max_speed_radps * (wanted.left_radps / fastest),
               limits_.max_speed_radps * (wanted.right_radps / fastest)};
  }
  if (auto done = do_set_speeds(applied); !done) return done.error();
  return applied;
}

}  // namespace twocone
