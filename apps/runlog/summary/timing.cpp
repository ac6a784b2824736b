// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/summary/summary.h"

#include <algorithm>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "base/quantile.h"

namespace twocone::runlog {
namespace {

constexpr const char* kKept = "kept";
constexpr const char* kOver = "over";
constexpr double kMsPerS = 1000;

}  // namespace

TimingRow to_row(std::uint64_t frame, double t_s, const estimation::Timing& timing, bool has_budget) {
  const char* const verdict = !has_budget ? "" : timing.is_over_budget ? kOver : kKept;
  return {frame, t_s, timing.vision_s, timing.localisation_s, timing.wall_s, timing.refined, verdict};
}

std::optional<std::string> budget_event(const std::vector<TimingRow>& rows, double budget_s) {
  const TimingRow* worst = nullptr;
  int over = 0;
  for (const TimingRow& row : rows) {
    if (row.verdict != kOver) continue;
    ++over;
    if (worst == nullptr || row.wall_s > worst->wall_s) worst = &row;
  }
  if (worst == nullptr) return std::nullopt;
  return fmt::format(
      "over time budget: {} of {} frames took longer than {:.4g} ms, frame {} the longest with {:.1f} ms", over,
      rows.size(), budget_s * kMsPerS, worst->frame, worst->wall_s * kMsPerS);
}

std::optional<TimingSummary> summarise_timing(const RunData& run) {
  const std::vector<TimingRow>& rows = run.timing;
  if (rows.empty()) return std::nullopt;
  const bool is_outline = run.method == to_string(estimation::Method::kOutline);  // a run folder may name any method
  TimingSummary summary;
  summary.frames = int(rows.size());
  const auto quantile = [&rows](const auto& value, double share) {
    std::vector<double> values;
    values.reserve(rows.size());
    for (const TimingRow& row : rows) values.push_back(std::invoke(value, row));
    return base::quantile(std::move(values), share);
  };
  summary.vision_median_s = quantile(&TimingRow::vision_s, 0.5);
  summary.localisation_median_s = quantile(&TimingRow::localisation_s, 0.5);
  summary.both_p95_s = quantile([](const TimingRow& row) { return row.vision_s + row.localisation_s; }, 0.95);
  if (is_outline) {
    double refined = 0;
    for (const TimingRow& row : rows) refined += row.refined;
    summary.refined_mean = refined / double(rows.size());
  }
  const auto& chosen = run.robot.estimator.landmarks;
  summary.landmarks = int(chosen.empty() ? run.map.landmarks.size() : chosen.size());
  if (is_outline) summary.budget_s = estimation::time_limit_of(estimation::Method::kOutline, run.robot);
  summary.kept = int(std::ranges::count_if(rows, [](const TimingRow& r) { return r.verdict == kKept; }));
  return summary;
}

}  // namespace twocone::runlog
