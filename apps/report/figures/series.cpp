// SPDX-License-Identifier: Apache-2.0
#include "apps/report/figures/series.h"

#include <algorithm>
#include <cmath>

namespace twocone::report {
namespace {

/// A .tum file's time may be rounded to the microsecond, and frames are milliseconds apart at the least.
constexpr double kSameInstant_s = 0.5e-3;

}  // namespace

FrameSpan frame_span(const runs::RunData& run) {
  if (run.frames.empty()) return {};
  const auto [first, last] = std::minmax_element(run.frames.begin(), run.frames.end(),
                                                 [](const auto& a, const auto& b) { return a.frame < b.frame; });
  return {static_cast<double>(first->frame) - 0.5, static_cast<double>(last->frame) + 0.5};
}

std::vector<std::optional<runs::PoseRow>> at_frames(const runs::RunData& run, const std::vector<runs::PoseRow>& poses) {
  std::vector<runs::PoseRow> sorted = poses;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
  std::vector<std::optional<runs::PoseRow>> result;
  for (const runs::FrameRow& frame : run.frames) {
    const auto found = std::lower_bound(sorted.begin(), sorted.end(), frame.t_s - kSameInstant_s,
                                        [](const runs::PoseRow& pose, double t_s) { return pose.t_s < t_s; });
    const bool there = found != sorted.end() && found->t_s <= frame.t_s + kSameInstant_s;
    result.push_back(there ? std::optional(*found) : std::nullopt);
  }
  return result;
}

std::vector<std::optional<double>> odometry_errors_m(const runs::RunData& run) {
  const auto truth = at_frames(run, run.truth);
  const auto odometry = at_frames(run, run.odometry);
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

std::vector<const runs::RangeRow*> rows_of(const runs::RunData& run, const std::string& landmark) {
  std::vector<const runs::RangeRow*> rows;
  for (const runs::RangeRow& row : run.ranges) {
    if (row.landmark == landmark) rows.push_back(&row);
  }
  return rows;
}

}  // namespace twocone::report
