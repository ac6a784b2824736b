// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"

/// What equation 1 of Burbridge & Spacek 2006 implies for a rig. Everything except is_right_angled requires 90 degree
/// cones; R, d and v are those of the lower mirror.
namespace twocone::report {

/// Returns whether both cones have an apex angle of 90 degrees.
bool is_right_angled(const config::Rig& rig);

/// Returns the change of range for one pixel of disparity at `range_m`, in metres: (range + d)^2 / (v s).
double range_per_pixel_m(const config::Rig& rig, double range_m);

/// Returns the nearest range at which both mirrors see a point above the upper tip inside the lower rim: s (d + R) / R
/// - d.
double nearest_common_m(const config::Rig& rig);

/// Returns the range below which a top at `top_m` above the floor is outside the lower rim; 0 if it never is.
double nearest_top_m(const config::Rig& rig, double top_m);

/// Returns the mean range error that rounding both matches to whole pixels alone would cause at the true ranges to one
/// landmark of this run: two independent errors, each uniform within half a pixel, differ by a third of a pixel on
/// average. Returns nothing without ground truth, without ranges, or for cones of another angle.
std::optional<double> rounding_error_m(const runlog::RunData& run, const config::Landmark& landmark);

}  // namespace twocone::report
