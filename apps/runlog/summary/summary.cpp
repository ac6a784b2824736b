// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/summary/summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <nlohmann/json.hpp>

#include "apps/runlog/summary/bounds.h"
#include "base/quantile.h"
#include "localisation/odometry.h"

namespace twocone::runlog {
namespace {

constexpr int kHeadingBins = 36;

/// @param unit m or rad
nlohmann::ordered_json to_json(const std::optional<ErrorStatistics>& s, const std::string& unit) {
  if (!s) return nullptr;
  return {{"count", s->count},
          {"mean_" + unit, s->mean},
          {"rmse_" + unit, s->rmse},
          {"p95_" + unit, s->p95},
          {"max_" + unit, s->max}};
}

nlohmann::ordered_json or_null(const std::optional<double>& x) {
  return x ? nlohmann::ordered_json(*x) : nlohmann::ordered_json();
}

/// @param unit m or rad
nlohmann::ordered_json to_json(const std::optional<BoundComparison>& bound, const std::string& unit) {
  if (!bound) return nullptr;
  return {{"count", bound->count},
          {"bound_rms_" + unit, bound->bound_rms},
          {"rmse_" + unit, or_null(bound->rmse)},
          {"rmse_over_bound", or_null(bound->ratio())}};
}

nlohmann::ordered_json to_json(const std::optional<Share>& share) {
  if (!share) return nullptr;
  return {{"held", share->held}, {"count", share->count}, {"share", double(share->held) / share->count}};
}

/// Accumulates one BoundComparison.
class Comparison {
 public:
  void add(double bound, std::optional<double> error) {
    ++count_;
    bound_squares_ += bound * bound;
    if (!error) return;
    ++errors_;
    error_squares_ += *error * *error;
  }
  [[nodiscard]] std::optional<BoundComparison> result() const {
    if (count_ == 0) return std::nullopt;
    BoundComparison bound{count_, std::sqrt(bound_squares_ / count_), {}};
    if (errors_ == count_) bound.rmse = std::sqrt(error_squares_ / count_);
    return bound;
  }

 private:
  int count_ = 0;
  int errors_ = 0;
  double bound_squares_ = 0;
  double error_squares_ = 0;
};

using Bounds = std::map<std::uint64_t, FrameBound>;

double heading_error_rad(double heading_rad, double truth_rad) {
  return std::abs(localisation::wrap_angle_rad(heading_rad - truth_rad));
}

void add(std::optional<Share>& share, bool held) {
  if (!share) share.emplace();
  ++share->count;
  share->held += held ? 1 : 0;
}

LandmarkSummary summarise_landmark(const RunData& run, std::size_t place, const Bounds& bounds) {
  const std::string& name = run.map.landmarks[place].name;
  LandmarkSummary summary;
  summary.name = name;
  Comparison comparison;
  std::vector<double> errors_m;
  double true_sum_m = 0;
  int true_count = 0;
  for (const RangeRow& row : run.ranges) {
    if (row.landmark != name) continue;
    ++summary.verdicts[row.verdict];
    std::optional<double> error_m;
    if (row.range_m && row.true_range_m) error_m = std::abs(*row.range_m - *row.true_range_m);
    if (row.range_m) {
      ++summary.frames_with_range;
      const auto bound = bounds.find(row.frame);
      if (bound != bounds.end() && bound->second.landmarks[place]) {
        comparison.add(bound->second.landmarks[place]->range_m, error_m);
      }
    }
    if (!row.true_range_m) continue;
    true_sum_m += *row.true_range_m;
    ++true_count;
    if (!error_m) continue;
    errors_m.push_back(*error_m);
    if (row.sigma_range_m) add(summary.within_95, *error_m <= k95Sigmas * *row.sigma_range_m);
  }
  for (const FixRow& row : run.fixes) {
    const bool second = &row != run.fixes.data() && (&row)[-1].frame == row.frame;  // if ambiguous
    if (!second) summary.outliers += int(std::ranges::count(row.outliers, name));
  }
  summary.range_bound_m = comparison.result();
  summary.error = statistics(std::move(errors_m));
  if (true_count > 0) summary.mean_true_range_m = true_sum_m / true_count;
  return summary;
}

/// Returns whether the 95 % ellipse of a fix contains the truth, or nothing if the fix has no ellipse or no truth.
std::optional<bool> ellipse_holds(const FixRow& row) {
  if (!row.x_m || !row.y_m || !row.true_x_m || !row.true_y_m || row.verdict == "weak") return std::nullopt;
  if (!row.var_x_m2 || !row.cov_xy_m2 || !row.var_y_m2) return std::nullopt;
  const double dx_m = *row.x_m - *row.true_x_m;
  const double dy_m = *row.y_m - *row.true_y_m;
  const double determinant = *row.var_x_m2 * *row.var_y_m2 - *row.cov_xy_m2 * *row.cov_xy_m2;
  if (!(*row.var_x_m2 > 0) || !(determinant > 0)) return false;
  return dx_m * dx_m * *row.var_y_m2 - 2 * dx_m * dy_m * *row.cov_xy_m2 + dy_m * dy_m * *row.var_x_m2 <=
         k95Ellipse * determinant;
}

/// Result of one frame's fix, which may have two positions.
struct FrameFix {
  std::string verdict;
  bool position = false, heading = false;
  std::optional<double> error_m, heading_error_rad;  ///< the worse of two
  std::optional<bool> held;                          ///< true if one of two holds it
};

std::map<std::uint64_t, FrameFix> fixes_by_frame(const RunData& run) {
  std::map<std::uint64_t, double> true_headings_rad;
  for (std::size_t i = 0; i < run.truth.size() && i < run.frames.size(); ++i) {
    true_headings_rad[run.frames[i].frame] = run.truth[i].heading_rad;
  }
  std::map<std::uint64_t, FrameFix> fixes;
  for (const FixRow& row : run.fixes) {
    FrameFix& fix = fixes[row.frame];
    fix.verdict = row.verdict;
    if (is_out_of_bounds(row)) continue;
    if (row.x_m) fix.position = true;
    if (row.heading_rad) fix.heading = true;
    if (row.error_m) fix.error_m = std::max(fix.error_m.value_or(0), *row.error_m);
    const auto truth = true_headings_rad.find(row.frame);
    if (row.heading_rad && truth != true_headings_rad.end()) {
      fix.heading_error_rad =
          std::max(fix.heading_error_rad.value_or(0), heading_error_rad(*row.heading_rad, truth->second));
    }
    if (const auto held = ellipse_holds(row)) fix.held = *held || fix.held.value_or(false);
  }
  return fixes;
}

void summarise_fixes(const RunData& run, const Bounds& bounds, Summary& summary) {
  std::vector<double> errors_m;
  std::vector<double> heading_errors_rad;
  Comparison position;
  Comparison heading;
  Comparison whole_position;
  Comparison whole_heading;
  for (const auto& [frame, fix] : fixes_by_frame(run)) {
    ++summary.fix_verdicts[fix.verdict];
    summary.frames_with_fix += fix.position ? 1 : 0;
    if (fix.error_m) errors_m.push_back(*fix.error_m);
    if (fix.heading_error_rad) heading_errors_rad.push_back(*fix.heading_error_rad);
    if (fix.held) add(summary.in_ellipse_95, *fix.held);
    const auto bound = bounds.find(frame);
    if (bound == bounds.end() || !bound->second.covariance) continue;
    const Eigen::Matrix3d& covariance = *bound->second.covariance;
    if (fix.position) position.add(std::sqrt(covariance(0, 0) + covariance(1, 1)), fix.error_m);
    if (fix.heading) heading.add(std::sqrt(covariance(2, 2)), fix.heading_error_rad);
    if (!bound->second.whole_covariance) continue;
    const Eigen::Matrix3d& whole = *bound->second.whole_covariance;
    if (fix.position) whole_position.add(std::sqrt(whole(0, 0) + whole(1, 1)), fix.error_m);
    if (fix.heading) whole_heading.add(std::sqrt(whole(2, 2)), fix.heading_error_rad);
  }
  summary.fix_error = statistics(std::move(errors_m));
  summary.heading_error = statistics(std::move(heading_errors_rad));
  summary.position_bound_m = position.result();
  summary.heading_bound_rad = heading.result();
  summary.whole_position_bound_m = whole_position.result();
  summary.whole_heading_bound_rad = whole_heading.result();
}

void summarise_estimate(const RunData& run, Summary& summary) {
  if (run.truth.empty()) return;
  std::vector<double> errors_m;
  std::vector<double> heading_errors_rad;
  const auto estimate = at_frames(run, run.estimate);
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    if (!estimate[i]) continue;
    const PoseRow& truth = run.truth[i];
    errors_m.push_back(std::hypot(estimate[i]->x_m - truth.x_m, estimate[i]->y_m - truth.y_m));
    heading_errors_rad.push_back(heading_error_rad(estimate[i]->heading_rad, truth.heading_rad));
  }
  summary.estimate_error = statistics(std::move(errors_m));
  summary.estimate_heading_error = statistics(std::move(heading_errors_rad));
}

void summarise_track(const RunData& run, Summary& summary) {
  for (const TrackRow& row : run.track) {
    if (!row.state.empty()) ++summary.track_states[row.state];
    ++summary.track_uses[row.use];
  }
}

void summarise_path(const RunData& run, Summary& summary) {
  std::vector<double> odometry_errors_m;
  std::set<int> bins;
  double travelled_m = 0;
  for (std::size_t i = 0; i < run.truth.size(); ++i) {
    const PoseRow& truth = run.truth[i];
    if (has_odometry(run))
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

std::optional<ErrorStatistics> statistics(std::vector<double> errors) {
  if (errors.empty()) return std::nullopt;
  std::ranges::sort(errors);
  ErrorStatistics s;
  s.count = int(errors.size());
  for (const double e : errors) {
    s.mean += e / s.count;
    s.rmse += e * e / s.count;
  }
  s.rmse = std::sqrt(s.rmse);
  s.p95 = errors[(errors.size() * 95 + 99) / 100 - 1];
  s.max = errors.back();
  return s;
}

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

Summary summarise(const RunData& run) {
  Summary summary;
  summary.method = run.method;
  summary.frames = int(run.frames.size());
  if (!run.frames.empty()) summary.duration_s = run.frames.back().t_s - run.frames.front().t_s;
  Bounds by_frame;
  for (FrameBound& bound : bounds(run)) by_frame[bound.frame] = std::move(bound);
  for (std::size_t i = 0; i < run.map.landmarks.size(); ++i) {
    summary.landmarks.push_back(summarise_landmark(run, i, by_frame));
  }
  summarise_fixes(run, by_frame, summary);
  summarise_estimate(run, summary);
  summarise_track(run, summary);
  summarise_path(run, summary);
  summary.capture = summarise_capture(run);
  return summary;
}

std::string to_json(const Summary& summary, const RunInfo& info) {
  nlohmann::ordered_json json;
  for (const auto& [key, member] : kProgramKeys) json[key] = info.*member;
  json["seed"] = info.seed;
  json["behaviour"] = info.behaviour;
  json["finished"] = info.finished;
  for (const auto& [key, member] : kTimeKeys) json[key] = info.*member;
  json["method"] = summary.method;
  json["frames"] = summary.frames;
  json["duration_s"] = summary.duration_s;
  for (const LandmarkSummary& l : summary.landmarks) {
    json["landmarks"].push_back({{"name", l.name},
                                 {"verdicts", l.verdicts},
                                 {"range_error", to_json(l.error, "m")},
                                 {"mean_true_range_m", or_null(l.mean_true_range_m)},
                                 {"frames_with_range", l.frames_with_range},
                                 {"range_bound", to_json(l.range_bound_m, "m")},
                                 {"range_within_1.96_sigma", to_json(l.within_95)},
                                 {"outliers", l.outliers}});
  }
  json["fix"] = {{"frames_with_fix", summary.frames_with_fix},
                 {"verdicts", summary.fix_verdicts},
                 {"position_error", to_json(summary.fix_error, "m")},
                 {"heading_error", to_json(summary.heading_error, "rad")},
                 {"position_bound", to_json(summary.position_bound_m, "m")},
                 {"heading_bound", to_json(summary.heading_bound_rad, "rad")},
                 {"position_bound_with_map_and_rig", to_json(summary.whole_position_bound_m, "m")},
                 {"heading_bound_with_map_and_rig", to_json(summary.whole_heading_bound_rad, "rad")},
                 {"position_in_95_percent_ellipse", to_json(summary.in_ellipse_95)}};
  json["estimate"] = {{"position_error", to_json(summary.estimate_error, "m")},
                      {"heading_error", to_json(summary.estimate_heading_error, "rad")}};
  json["track"] = {{"states", summary.track_states}, {"uses", summary.track_uses}};
  json["odometry_error"] = to_json(summary.odometry_error, "m");
  json["travelled_m"] = or_null(summary.travelled_m);
  json["headings_covered_deg"] = or_null(summary.headings_covered_deg);
  if (const auto& capture = summary.capture) {
    json["devices"] = info.devices;
    json["capture"] = {{"rate_hz", capture->rate_hz},
                       {"jitter_p95_s", capture->jitter_p95_s},
                       {"skew_median_s", capture->skew_median_s},
                       {"skew_max_s", capture->skew_max_s},
                       {"lower_lost", capture->lower_lost},
                       {"upper_lost", capture->upper_lost}};
    for (const auto& [key, member] : kCaptureCounts) json["capture"][key] = capture->counts.*member;
  }
  // A name that is not UTF-8 does not prevent the summary.
  return json.dump(2, ' ', false, decltype(json)::error_handler_t::replace) + "\n";
}

}  // namespace twocone::runlog
