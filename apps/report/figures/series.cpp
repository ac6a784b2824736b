// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/report/kit/figure.h"

namespace twocone::report {

FrameSpan frame_span(const runlog::RunData& run) {
  if (run.frames.empty()) return {};
  const auto [first, last] = std::ranges::minmax_element(run.frames, {}, &runlog::FrameRow::frame);
  return {double(first->frame) - 0.5, double(last->frame) + 0.5};
}

std::vector<std::optional<double>> odometry_errors_m(const runlog::RunData& run) {
  const auto truth = runlog::at_frames(run, run.truth);
  const auto odometry = runlog::at_frames(run, run.odometry);
  std::vector<std::optional<double>> errors(run.frames.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (truth[i] && odometry[i]) {
      errors[i] = std::hypot(odometry[i]->x_m - truth[i]->x_m, odometry[i]->y_m - truth[i]->y_m);
    }
  }
  return errors;
}

std::vector<const runlog::RangeRow*> rows_of(const runlog::RunData& run, const std::string& landmark) {
  std::vector<const runlog::RangeRow*> rows;
  for (const runlog::RangeRow& row : run.ranges) {
    if (row.landmark == landmark) rows.push_back(&row);
  }
  return rows;
}

std::ptrdiff_t count_beyond(const std::vector<double>& errors, double limit) {
  return std::count_if(errors.begin(), errors.end(), [limit](double error) { return error > limit; });
}

void add_error_plots(const ErrorPoints& points, std::vector<std::string>& plots) {
  plots.push_back(
      fmt::format("{0} using 1:(${1} <= {2:.9g} ? ${1} : NaN) with points pt 7 ps 0.4 lc rgb '{3}' title 'fix'",
                  points.block, points.column, points.limit, kFixColour));
  if (!points.is_beyond) return;
  plots.push_back(
      fmt::format("{0} using 1:(${1} > {2:.9g} ? {2:.9g} : NaN) with points pt 9 ps 0.9 lc rgb '{3}' title '{4}'",
                  points.block, points.column, points.limit, kFixColour, points.beyond_title));
}

}  // namespace twocone::report
