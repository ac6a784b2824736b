// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <nlohmann/json.hpp>

namespace twocone::runs {
namespace {

constexpr int kHeadingBins = 36;

nlohmann::ordered_json to_json(const std::optional<ErrorStatistics>& s) {
  if (!s) return nullptr;
  return {{"count", s->count}, {"mean_m", s->mean_m}, {"rmse_m", s->rmse_m}, {"p95_m", s->p95_m}, {"max_m", s->max_m}};
}

LandmarkSummary summarise_landmark(const RunData& run, const std::string& name) {
  LandmarkSummary summary;
  summary.name = name;
  std::vector<double> errors_m;
  double true_sum_m = 0;
  int true_count = 0;
  for (const RangeRow& row : run.ranges) {
    if (row.landmark != name) continue;
    ++summary.verdicts[row.verdict];
    if (!row.true_range_m) continue;
    true_sum_m += *row.true_range_m;
    ++true_count;
    if (row.range_m) errors_m.push_back(std::abs(*row.range_m - *row.true_range_m));
  }
  summary.error = statistics(std::move(errors_m));
  if (true_count > 0) summary.mean_true_range_m = true_sum_m / true_count;
  return summary;
}

void summarise_fixes(const RunData& run, Summary& summary) {
  std::map<std::uint64_t, std::string> verdicts;
  std::map<std::uint64_t, double> worst_m;
  std::set<std::uint64_t> with_fix;
  for (const FixRow& row : run.fixes) {
    verdicts[row.frame] = row.verdict;
    if (row.x_m) with_fix.insert(row.frame);
    if (row.error_m) worst_m[row.frame] = std::max(worst_m[row.frame], *row.error_m);
  }
  for (const auto& [frame, verdict] : verdicts) ++summary.fix_verdicts[verdict];
  std::vector<double> errors_m;
  errors_m.reserve(worst_m.size());
  for (const auto& [frame, error] : worst_m) errors_m.push_back(error);
  summary.fix_error = statistics(std::move(errors_m));
  summary.frames_with_fix = int(with_fix.size());
}

void summarise_path(const RunData& run, Summary& summary) {
  std::vector<double> odometry_errors_m;
  std::set<int> bins;
  double travelled_m = 0;
  for (std::size_t i = 0; i < run.truth.size(); ++i) {
    const PoseRow& truth = run.truth[i];
    odometry_errors_m.push_back(std::hypot(run.odometry[i].x_m - truth.x_m, run.odometry[i].y_m - truth.y_m));
    const double turn = truth.heading_rad / (2 * std::numbers::pi);
    bins.insert(std::clamp(int(std::floor((turn - std::floor(turn)) * kHeadingBins)), 0, kHeadingBins - 1));
    if (i > 0) travelled_m += std::hypot(truth.x_m - run.truth[i - 1].x_m, truth.y_m - run.truth[i - 1].y_m);
  }
  summary.odometry_error = statistics(std::move(odometry_errors_m));
  if (!run.truth.empty()) {
    summary.travelled_m = travelled_m;
    summary.headings_covered_deg = double(bins.size()) * 360 / kHeadingBins;
  }
}

}  // namespace

std::optional<ErrorStatistics> statistics(std::vector<double> errors_m) {
  if (errors_m.empty()) return std::nullopt;
  std::sort(errors_m.begin(), errors_m.end());
  ErrorStatistics s;
  s.count = int(errors_m.size());
  for (const double e : errors_m) {
    s.mean_m += e / s.count;
    s.rmse_m += e * e / s.count;
  }
  s.rmse_m = std::sqrt(s.rmse_m);
  s.p95_m = errors_m[(errors_m.size() * 95 + 99) / 100 - 1];
  s.max_m = errors_m.back();
  return s;
}

Summary summarise(const RunData& run) {
  Summary summary;
  summary.method = run.method;
  summary.frames = int(run.frames.size());
  if (!run.frames.empty()) summary.duration_s = run.frames.back().t_s - run.frames.front().t_s;
  for (const files::Landmark& landmark : run.map.landmarks) {
    summary.landmarks.push_back(summarise_landmark(run, landmark.name));
  }
  summarise_fixes(run, summary);
  summarise_path(run, summary);
  return summary;
}

std::string to_json(const Summary& summary, const RunInfo& info) {
  nlohmann::ordered_json json;
  json["twocone"] = info.version;
  json["commit"] = info.commit;
  json["compiler"] = info.compiler;
  json["seed"] = info.seed;
  json["behaviour"] = info.behaviour;
  json["finished"] = info.finished;
  json["wall_s"] = info.wall_s;
  json["render_wait_s"] = info.render_wait_s;
  json["own_cpu_s"] = info.own_cpu_s;
  json["render_cpu_s"] = info.render_cpu_s;
  json["method"] = summary.method;
  json["frames"] = summary.frames;
  json["duration_s"] = summary.duration_s;
  for (const LandmarkSummary& l : summary.landmarks) {
    json["landmarks"].push_back(
        {{"name", l.name},
         {"verdicts", l.verdicts},
         {"range_error", to_json(l.error)},
         {"mean_true_range_m",
          l.mean_true_range_m ? nlohmann::ordered_json(*l.mean_true_range_m) : nlohmann::ordered_json()}});
  }
  json["fix"] = {{"frames_with_fix", summary.frames_with_fix},
                 {"verdicts", summary.fix_verdicts},
                 {"position_error", to_json(summary.fix_error)}};
  json["odometry_error"] = to_json(summary.odometry_error);
  const auto or_null = [](const std::optional<double>& x) {
    return x ? nlohmann::ordered_json(*x) : nlohmann::ordered_json();
  };
  json["travelled_m"] = or_null(summary.travelled_m);
  json["headings_covered_deg"] = or_null(summary.headings_covered_deg);
  return json.dump(2) + "\n";
}

}  // namespace twocone::runs
