// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/summary/capture.h"

#include <cmath>
#include <vector>

#include "base/quantile.h"

namespace twocone::runlog {

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
  if (skews_s.empty()) return summary;
  summary.skew_median_s = base::quantile(skews_s, 0.5);
  summary.skew_max_s = base::quantile(skews_s, 1);
  if (intervals_s.empty()) return summary;
  const double interval_s = base::quantile(intervals_s, 0.5);
  if (interval_s > 0) summary.rate_hz = 1 / interval_s;
  for (double& apart_s : intervals_s) apart_s = std::abs(apart_s - interval_s);
  summary.jitter_p95_s = base::quantile(intervals_s, 0.95);
  return summary;
}

}  // namespace twocone::runlog
