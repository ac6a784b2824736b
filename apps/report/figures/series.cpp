// SPDX-License-Identifier: Apache-2.0
#include "apps/report/figures/series.h"

#include <algorithm>
#include <cmath>

namespace twocone::report {
FrameSpan frame_span(const runlog::RunData& run) {
  if (run.frames.empty()) return {};
  const auto [first, last] = std::minmax_element(run.frames.begin(), run.frames.end(),
                                                 [](const auto& a, const auto& b) { return a.frame < b.frame; });
  return {static_cast<double>(first->frame) - 0.5, static_cast<double>(last->frame) + 0.5};
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

double readable_limit(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double most = values[(values.size() * 98 + 99) / 100 - 1];
  return most > 0 && values.back() > 3 * most ? 1.5 * most : values.back();
}

std::vector<const runlog::RangeRow*> rows_of(const runlog::RunData& run, const std::string& landmark) {
  std::vector<const runlog::RangeRow*> rows;
  for (const runlog::RangeRow& row : run.ranges) {
    if (row.landmark == landmark) rows.push_back(&row);
  }
  return rows;
}

}  // namespace twocone::report
