// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/doctor/doctor.h"
#include "vision/rim.h"

namespace twocone::doctor {

/// Returns the rim in the image according to `rig:`.
vision::RimCircle rim_of(const config::RigView& view);

/// Checks a robot without any device: it is opened and started, one pair is taken, and its images are checked, for
/// sim_povray including the rims. @throws Interrupted
void check_whole_robot(const config::Robot& robot, const drivers::RobotSettings& settings, const Openers& openers,
                       const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor
