// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/runlog/run_data.h"

namespace twocone::report {

constexpr double kMmPerM = 1000;
std::optional<double> in_mm(std::optional<double> metres);

/// The first and the last frame number, widened so that even one frame has a width.
struct FrameSpan {
  double first = -0.5;
  double last = 0.5;
};
FrameSpan frame_span(const runlog::RunData& run);

/// Returns the distance of odometry from truth at each frame, in metres; nothing where either is missing.
std::vector<std::optional<double>> odometry_errors_m(const runlog::RunData& run);

/// Returns the ranges to one landmark, in their order.
std::vector<const runlog::RangeRow*> rows_of(const runlog::RunData& run, const std::string& landmark);

/// Returns the number of absolute errors beyond the end of their axis.
std::ptrdiff_t count_beyond(const std::vector<double>& errors, double limit);

/// Errors in a data block of which the first column is the place.
struct ErrorPoints {
  std::string_view block;
  int column;      ///< of the errors, from 1
  double limit;    ///< end of their axis
  bool is_beyond;  ///< some errors lie beyond it
  std::string_view beyond_title;
};
/// Adds plots of the errors of fixes: dots, and beyond the limit triangles on it.
void add_error_plots(const ErrorPoints& points, std::vector<std::string>& plots);

}  // namespace twocone::report
