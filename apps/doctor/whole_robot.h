// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/doctor/doctor.h"
#include "vision/rim.h"

namespace twocone::doctor {

/// Where `rig:` says that the rim is in the picture.
vision::RimCircle rim_of(const files::RigView& view);

/// A robot none of whose parts has a device: it is opened, started, asked for a pair, and its pictures are looked at,
/// for the rims where it is sim_povray that makes them. @throws Interrupted
void check_whole_robot(const files::Robot& robot, const drivers::RobotSettings& settings, const Openers& openers,
                       const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor
