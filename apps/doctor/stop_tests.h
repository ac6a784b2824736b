// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/doctor/drive_checks.h"
#include "apps/doctor/wheel_bench.h"

namespace twocone::doctor {

/// Seconds from `stop_s` until the wheels came to rest, to the time between two samples; nothing where they had not
/// when the samples end.
std::optional<double> rest_after(double stop_s, const Course& watched, double still_rad);

/// @param stop_s nothing: the wheels turned on until the end of the watch
Row judge_stop(const char* check, const std::optional<double>& stop_s, const DriveLimits& limits);

/// Both ways, from a modest speed: told to stop, and told nothing any more. In the second the angles are not read until
/// the wheels must rest, as a driver may stop them when it is asked; how long they ran on is the angle that they turned
/// over their speed, so that a wheel which coasts to rest evenly counts half of its coasting.
void test_stopping(const DriveUnderTest& test, DiffDrive& drive, WheelBench& bench, const Surroundings& surroundings,
                   Report& report);

}  // namespace twocone::doctor
