// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/effort.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/runs/quantile.h"

namespace twocone::runs {
namespace {

constexpr const char* kKept = "kept";
constexpr const char* kOver = "over";
constexpr double kMsPerS = 1000;

template <typename Value>
std::vector<double> values_of(const std::vector<EffortRow>& rows, const Value& value) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const EffortRow& row : rows) values.push_back(value(row));
  return values;
}

}  // namespace

Method method_of(const files::Robot& robot) {
  return robot.estimator.method.empty() ? kDefaultMethod : method_named(robot.estimator.method);
}

files::Robot with_budget(files::Robot robot, Method method, double budget_s) {
  if (!(budget_s > 0) || !std::isfinite(budget_s)) {
    throw std::invalid_argument(fmt::format("the budget is {} ms, must be > 0 ms and finite", budget_s * kMsPerS));
  }
  if (method == Method::kPaper) {
    throw std::invalid_argument(fmt::format("method {} has no stages to stop at: a budget needs method {}",
                                            to_string(method), to_string(Method::kFull)));
  }
  robot.estimator.method = to_string(method);  // a file with method paper could not say `stage`
  robot.estimator.stage = "adaptive";
  robot.estimator.budget_s = budget_s;
  return robot;
}

std::optional<double> budget_of(Method method, const files::Robot& robot) {
  const bool is_adaptive = method == Method::kFull && robot.estimator.stage == "adaptive";
  return is_adaptive ? robot.estimator.budget_s : std::nullopt;
}

EffortRow to_row(std::uint64_t frame, double t_s, const Effort& effort, bool has_budget) {
  const char* const verdict = !has_budget ? "" : effort.is_over_budget ? kOver : kKept;
  return {frame, t_s, effort.vision_s, effort.localisation_s, effort.wall_s, effort.refined, verdict};
}

std::optional<std::string> budget_event(const std::vector<EffortRow>& rows, double budget_s) {
  const EffortRow* worst = nullptr;
  int over = 0;
  for (const EffortRow& row : rows) {
    if (row.verdict != kOver) continue;
    ++over;
    if (worst == nullptr || row.wall_s > worst->wall_s) worst = &row;
  }
  if (worst == nullptr) return std::nullopt;
  return fmt::format("over budget: {} of {} frames took longer than {:.4g} ms, frame {} the longest with {:.1f} ms",
                     over, rows.size(), budget_s * kMsPerS, worst->frame, worst->wall_s * kMsPerS);
}

std::optional<EffortSummary> summarise_effort(const RunData& run) {
  const std::vector<EffortRow>& rows = run.effort;
  if (rows.empty()) return std::nullopt;
  const bool is_full = run.method == to_string(Method::kFull);  // a run folder may name any method
  EffortSummary summary;
  summary.frames = int(rows.size());
  summary.vision_median_s = quantile(values_of(rows, [](const EffortRow& r) { return r.vision_s; }), 0.5);
  summary.localisation_median_s = quantile(values_of(rows, [](const EffortRow& r) { return r.localisation_s; }), 0.5);
  summary.both_p95_s =
      quantile(values_of(rows, [](const EffortRow& r) { return r.vision_s + r.localisation_s; }), 0.95);
  if (is_full) {
    double refined = 0;
    for (const EffortRow& row : rows) refined += row.refined;
    summary.refined_mean = refined / double(rows.size());
  }
  const auto& chosen = run.robot.estimator.landmarks;
  summary.landmarks = int(chosen.empty() ? run.map.landmarks.size() : chosen.size());
  if (is_full) summary.budget_s = budget_of(Method::kFull, run.robot);
  summary.kept = int(std::count_if(rows.begin(), rows.end(), [](const EffortRow& r) { return r.verdict == kKept; }));
  return summary;
}

}  // namespace twocone::runs
