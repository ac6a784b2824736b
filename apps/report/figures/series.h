// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/runs/run_data.h"

namespace twocone::report {

/// First and last frame number, widened so that even one frame has a width.
struct FrameSpan {
  double first = -0.5;
  double last = 0.5;
};
FrameSpan frame_span(const runs::RunData& run);

/// Distance of odometry from truth at each frame, metres; nothing where either is missing.
std::vector<std::optional<double>> odometry_errors_m(const runs::RunData& run);

/// Where an axis may end so that errors can be read: at the largest, or, when a few lie far beyond the rest (more than
/// 3 times the 98th percentile), at 1.5 times that; those must then be marked at the edge. @param values >= 0; not
/// finite ones are left out
double readable_limit(std::vector<double> values);

/// The ranges to one landmark, in their order.
std::vector<const runs::RangeRow*> rows_of(const runs::RunData& run, const std::string& landmark);

}  // namespace twocone::report
