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
  double period_s = 0;  ///< of frames: the angles are read once in each
};

/// What stops the wheels when the program does not: the controller's own time-out, or the guard.
Row judge_timeout(const DriveFacts& facts, const DriveLimits& limits);

/// Controller, time-out, reading, and whether the wheels rest that nobody told to turn. No command is given.
/// @return whether moving tests make sense @throws Interrupted
bool check_drive_at_rest(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings,
                         Report& report);

/// Asks, unless it was said beforehand, whether both wheels are off the ground; nothing but "yes" permits.
/// A row `not run` where it is refused.
Permission ask_off_the_ground(bool was_said, const Surroundings& surroundings, Report& report);

/// The moving tests: which wheel turns which way, speed, the least speed, counts per turn, the two ways of stopping.
/// The wheels must be off the ground; they rest afterwards, whatever happens. @throws Interrupted
void check_wheels(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor
