// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/capture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace twocone::runs {
namespace {

/// The nearest rank; 0 of nothing.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto rank = std::size_t(std::ceil(share * double(values.size())));
  const auto place = values.begin() + std::ptrdiff_t(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

std::optional<CaptureSummary> summarise_capture(const RunData& run) {
  if (!run.info.capture) return std::nullopt;
  CaptureSummary summary;
  summary.counts = *run.info.capture;
  std::vector<double> skews_s;
  std::vector<double> intervals_s;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const FrameRow& frame = run.frames[i];
    skews_s.push_back(std::abs(frame.skew_s));
    summary.lower_lost += frame.lower_lost;
    summary.upper_lost += frame.upper_lost;
    if (i > 0) intervals_s.push_back(frame.t_s - run.frames[i - 1].t_s);
  }
  summary.skew_median_s = quantile(skews_s, 0.5);
  summary.skew_max_s = quantile(skews_s, 1);
  const double interval_s = quantile(intervals_s, 0.5);
  if (interval_s > 0) summary.rate_hz = 1 / interval_s;
  for (double& apart_s : intervals_s) apart_s = std::abs(apart_s - interval_s);
  summary.jitter_p95_s = quantile(intervals_s, 0.95);
  return summary;
}

}  // namespace twocone::runs
