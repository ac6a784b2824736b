// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/runlog/run_data.h"

namespace twocone::report {

/// The first and the last frame number, widened so that even one frame has a width.
struct FrameSpan {
  double first = -0.5;
  double last = 0.5;
};
FrameSpan frame_span(const runlog::RunData& run);

/// Returns the distance of odometry from truth at each frame, in metres; nothing where either is missing.
std::vector<std::optional<double>> odometry_errors_m(const runlog::RunData& run);

/// Returns the end of an axis on which errors can be read: the largest value, or 1.5 times the 98th percentile where a
/// few values lie more than 3 times that percentile out; those must then be marked at the edge. @param values >= 0;
/// values that are not finite are ignored
double readable_limit(std::vector<double> values);

/// Returns the ranges to one landmark, in their order.
std::vector<const runlog::RangeRow*> rows_of(const runlog::RunData& run, const std::string& landmark);

}  // namespace twocone::report
