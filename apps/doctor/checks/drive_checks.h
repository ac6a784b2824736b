// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/doctor/report.h"
#include "apps/doctor/surroundings.h"
#include "drivers/backends.h"
#include "hal/diff_drive.h"

namespace twocone::doctor {

/// Whether the wheels may be turned.
enum class Permission { kGiven, kRefused };

struct DriveUnderTest {
  drivers::DrivePart asked;
  double period_s = 0;  ///< period of the frames: the angles are read once in each
};

/// Judges what stops the wheels when the program does not: the controller's own time-out, or the watchdog.
Row judge_timeout(const DriveFacts& facts, const DriveLimits& limits);

/// Checks controller, time-out, reading, and whether the wheels stand still without a command. No command is given.
/// @return whether the moving tests make sense. @throws Interrupted
bool check_standing_drive(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings,
                          Report& report);

/// Asks whether both wheels are off the ground, unless the user has stated it before; only "yes" permits the moving
/// tests. Otherwise adds a row `not run`.
Permission ask_off_the_ground(bool was_said, const Surroundings& surroundings, Report& report);

/// The moving tests: which wheel turns in which direction, speed, the least speed, counts per turn, the two ways of
/// stopping. The wheels must be off the ground. They are stopped afterwards, in every case. @throws Interrupted
void check_wheels(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor
