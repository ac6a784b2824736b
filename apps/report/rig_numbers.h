// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "apps/files/robot_file.h"
#include "apps/runs/run_data.h"

/// What equation 1 of Burbridge & Spacek 2006 says about a rig. All but is_right_angled hold for 90 degree cones only;
/// R, d, v are those of the lower mirror.
namespace twocone::report {

/// Both cones have 90 degrees.
bool is_right_angled(const files::Rig& rig);

/// Change of range for one pixel of disparity at `range_m`, metres: (range + d)^2 / (v s).
double range_per_pixel_m(const files::Rig& rig, double range_m);

/// The nearest range at which both mirrors see a point above the upper tip inside the lower rim: s (d + R) / R - d.
double nearest_common_m(const files::Rig& rig);

/// The range below which a top at `top_m` above the floor is outside the lower rim; 0 if it never is.
double nearest_top_m(const files::Rig& rig, double top_m);

/// Mean range error that would come from rounding both matches to whole pixels and from nothing else, at the true
/// ranges to one landmark of this run: two independent errors, each even within half a pixel, differ by a third of a
/// pixel on average. Nothing without truth, without ranges or for other cones.
std::optional<double> rounding_error_m(const runs::RunData& run, const files::Landmark& landmark);

}  // namespace twocone::report
