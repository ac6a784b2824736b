// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/doctor/checks/drive_checks.h"
#include "apps/doctor/wheel_bench.h"

namespace twocone::doctor {

/// Returns the time in seconds from `stop_s` until the wheels stood still, to the resolution of two samples; nothing if
/// they still turned at the last sample.
std::optional<double> stop_time_after(double stop_s, const Course& watched, double still_rad);

/// @param stop_s nothing: the wheels turned until the end of the observation
Row judge_stop(const char* check, const std::optional<double>& stop_s, const DriveLimits& limits);

/// Tests both ways of stopping, from a moderate speed: by a command, and by silence. In the second test the angles are
/// not read until the wheels must stand still, because a reading may make a driver stop them. The running time is the
/// angle that they turned over their speed, so a wheel that coasts evenly counts half of its coasting.
void test_stopping(const DriveUnderTest& test, DiffDrive& drive, WheelBench& bench, const Surroundings& surroundings,
                   Report& report);

}  // namespace twocone::doctor
