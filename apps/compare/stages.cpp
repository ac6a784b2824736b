// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "localisation/trajectory_error.h"

namespace twocone::compare {
namespace {

std::optional<double> times(std::optional<double> value, double factor) {
  return value ? std::optional(*value * factor) : std::nullopt;
}
std::optional<double> share_percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? std::nullopt : std::optional(100.0 * double(part) / double(whole));
}

class Table {
 public:
  Table(const Limits& limits, const std::vector<Source>& sources) : limits_(limits), sources_(sources) {}

  void stage(Stage stage) { stage_ = stage; }

  /// Adds a row. @param gap empty: the difference of both numbers, if both exist
  Row& add(std::string name, std::string unit, std::optional<double> simulated, std::optional<double> real,
           const char* limit_key = "", std::optional<double> gap = std::nullopt,
           std::optional<double> gap_sigma = std::nullopt) {
    Row row{stage_, std::move(name), std::move(unit), simulated, real, gap, gap_sigma, limit_key};
    if (!row.gap && simulated && real) row.gap = std::abs(*real - *simulated);
    if (*limit_key != '\0') {
      const auto own = limits_.find(limit_key);
      const auto kind = std::ranges::find(limit_kinds(), row.limit_key, &LimitKind::key);
      row.limit = own != limits_.end() ? own->second : kind->by_default;
      if (row.gap) row.light = light_of(*row.gap, row.gap_sigma, *row.limit);
    }
    return rows_.emplace_back(std::move(row));
  }

  /// Adds a row for the component of that name of a source, or a note why it is missing.
  void add(std::string name, Cause cause, std::optional<vision::Side> view, const std::string& component,
           const char* unit, const char* limit_key) {
    const Source* const source = find_source(sources_, cause, view);
    const auto& components = source ? source->components : std::vector<Component>{};
    const auto found = std::ranges::find(components, component, &Component::name);
    if (found != components.end()) {
      add(std::move(name), found->unit, found->simulated, found->real, limit_key, std::nullopt, found->sigma);
    } else {
      add(std::move(name), unit, std::nullopt, std::nullopt, limit_key).note = source ? source->reason : "not measured";
    }
  }

  std::vector<Row> take() { return std::move(rows_); }

 private:
  const Limits& limits_;
  const std::vector<Source>& sources_;
  Stage stage_ = Stage::kImage;
  std::vector<Row> rows_;
};

void add_image(Table& table, const Side& simulated, const Side& real) {
  table.stage(Stage::kImage);
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const std::string view(to_string(side));
    table.add(view + " rim, radius", Cause::kFocalLength, side, view + ".rim_radius_px", "px", "rim-px");
    for (const char* const axis : {"column", "row"}) {
      table.add(fmt::format("{} centre, {}", view, axis), Cause::kCentre, side,
                fmt::format("{}.centre_px.{}", view, axis), "px", "centre-px");
    }
    for (const char* const colour : {"red", "green", "blue"}) {
      table.add(fmt::format("{} {}, real over simulated", view, colour), Cause::kExposureAndColour, side,
                fmt::format("gain.{}", colour), "1", "gain");
    }
    table.add(view + " noise at mid grey", Cause::kNoise, side, "noise", "grey", "noise-grey");
    table.add(view + " edges' spread", Cause::kSharpness, side, "blur", "px", "blur-px");
    const auto edges = [side](const Side& of) {
      return of.calibration ? std::optional(of.calibration->result.rms_before_px[std::size_t(side)]) : std::nullopt;
    };
    table.add(view + " edge error under the believed rig, rms", "px", edges(simulated), edges(real), "edges-px");
  }
}

/// Counts, in frames at about the same place, the landmarks that have a range in one run and not in the other.
void add_detection(Table& table, const Side& simulated, const Side& real, const Residuals& a, const Residuals& b,
                   const std::vector<Match>& by_pose) {
  table.stage(Stage::kDetection);
  table.add("landmarks with a range", "%", share_percent(a.ranged, a.looked_for),
            share_percent(b.ranged, b.looked_for));
  std::size_t both = 0, missed = 0, more = 0;
  for (std::size_t k = 0; k < real.run.map.landmarks.size(); ++k) {
    const auto& names = simulated.run.map.landmarks;
    const auto same = std::ranges::find(names, real.run.map.landmarks[k].name, &config::Landmark::name);
    if (same == names.end()) continue;
    const auto of_simulated = std::size_t(same - names.begin());
    for (const Match& match : by_pose) {
      const bool in_a = a.has_range[match.simulated * names.size() + of_simulated];
      const bool in_b = b.has_range[match.real * real.run.map.landmarks.size() + k];
      both += in_a ? 1 : 0;
      missed += in_a && !in_b ? 1 : 0;
      more += in_b && !in_a ? 1 : 0;
    }
  }
  const auto missed_percent = share_percent(missed, both);
  table
      .add("missed: ranged in the simulation only", "%", std::nullopt, missed_percent, "missed-percent", missed_percent)
      .note = missed_percent ? "" : "no frames at the same place";
  table.add("extra: ranged in the real run only", "%", std::nullopt, share_percent(more, both));
  const auto false_a = share_percent(a.outliers, a.ranged), false_b = share_percent(b.outliers, b.ranged);
  table.add("false: ranges that the fix left out as wrong", "%", false_a, false_b, "false-percent", false_b);
  table.add("frames with a fix", "%", share_percent(a.with_fix, a.frames), share_percent(b.with_fix, b.frames),
            "fix-percent");
}

void add_answers(Table& table, const Residuals& a, const Residuals& b) {
  const auto add = [&](Stage stage, const char* what, const char* unit, Moments Residuals::*moments, double shown,
                       const char* limit_key) {
    const Moments &of_a = a.*moments, &of_b = b.*moments;
    table.stage(stage);
    table.add(fmt::format("{} error at the reference pose, rms", what), unit, times(of_a.rms(), shown),
              times(of_b.rms(), shown), limit_key);
    table.add("mean", unit, times(of_a.mean(), shown), times(of_b.mean(), shown));
  };
  add(Stage::kDisparity, "disparity", "px", &Residuals::disparity_px, 1, "disparity-px");
  add(Stage::kRange, "range", "mm", &Residuals::range_m, 1e3, "range-mm");
  add(Stage::kBearing, "bearing", "deg", &Residuals::bearing_rad, 1 / kDegree, "bearing-deg");
  table.stage(Stage::kFix);
  table.add("error against the reference, rms", "mm", times(a.fix_m.rms(), 1e3), times(b.fix_m.rms(), 1e3), "fix-mm")
      .note = b.fix_m.count == 0 ? "the real run has no truth and no given trajectory" : "";
}

std::vector<localisation::PosePair> paths_by_time(const Side& simulated, const Side& real,
                                                  const std::vector<Match>& by_time) {
  std::vector<localisation::PosePair> pairs;
  for (const Match& match : by_time) {
    const auto &a = simulated.reference[match.simulated], &b = real.reference[match.real];
    if (a && b) pairs.push_back({pose_of(*a), pose_of(*b)});
  }
  return pairs;
}

void add_trajectories(Table& table, const Side& simulated, const Side& real, const std::vector<Match>& by_time) {
  table.stage(Stage::kOdometry);
  const auto drift = [](const Side& side) {
    return localisation::relative_error_over(pairs_with(side.reference, side.run.odometry), kOdometryStretch_m);
  };
  const auto a = drift(simulated), b = drift(real);
  const auto rms_of = [](const auto& error, double localisation::TrajectoryError::*which, double factor) {
    return error ? std::optional((*error).*which * factor) : std::nullopt;
  };
  using localisation::TrajectoryError;
  table.add("error over a metre (RPE), rms", "mm/m", rms_of(a, &TrajectoryError::rmse_m, 1e3),
            rms_of(b, &TrajectoryError::rmse_m, 1e3), "odometry-mm-per-m");
  table.add("heading error over a metre (RPE), rms", "deg/m", rms_of(a, &TrajectoryError::rmse_rad, 1 / kDegree),
            rms_of(b, &TrajectoryError::rmse_rad, 1 / kDegree));

  table.stage(Stage::kTrajectory);
  auto pairs = paths_by_time(simulated, real, by_time);
  const auto one = [&](const char* name, const std::optional<TrajectoryError>& error, const char* key) {
    const auto gap = rms_of(error, &TrajectoryError::rmse_m, 1e3);
    table.add(name, "mm", std::nullopt, std::nullopt, key, gap).note =
        gap ? "" : "too few frames at equal times with a reference";
  };
  one("distance of paths at equal times (APE), rms", localisation::absolute_error(pairs), "ape-mm");
  one("difference of the paths per frame (RPE), rms", localisation::relative_error(pairs, 1), "");
  one("difference of the paths per metre (RPE), rms", localisation::relative_error_over(pairs, kOdometryStretch_m), "");
  if (const auto align = localisation::alignment(pairs)) {
    for (localisation::PosePair& pair : pairs) pair.estimate = localisation::moved(*align, pair.estimate);
    one("distance, aligned paths (APE, Umeyama), rms", localisation::absolute_error(pairs), "ape-aligned-mm");
  }
}

void add_timing(Table& table, const Timing& a, const Timing& b) {
  table.stage(Stage::kTiming);
  const auto rate = [](const Timing& t) { return t.rate_hz > 0 ? std::optional(t.rate_hz) : std::nullopt; };
  const auto share = rate(a) && rate(b) ? std::optional(100 * std::abs(b.rate_hz / a.rate_hz - 1)) : std::nullopt;
  table.add("frame rate", "Hz", rate(a), rate(b), "rate-percent", share).note = "the limit is for the difference in %";
  table.add("jitter of a frame's time", "ms", 1e3 * a.jitter_s, 1e3 * b.jitter_s, "jitter-ms");
  table.add("stamped skew, mean", "ms", 1e3 * a.skew_s, 1e3 * b.skew_s, "skew-ms");
  table.add("stamped skew, largest", "ms", 1e3 * a.most_skew_s, 1e3 * b.most_skew_s);
  table.add("skew beyond the stamps", Cause::kSkew, std::nullopt, "upper.skew_s", "ms", "skew-ms");
  table.add("age of an image at its stamp", Cause::kLatency, std::nullopt, "latency_s", "ms", "latency-ms");
  table.add("growth of the images' age over the run", "ms", times(a.ageing_s, 1e3), times(b.ageing_s, 1e3)).note =
      b.ageing_s ? "" : "a simulated run has none";
  for (const vision::Side view : {vision::Side::kLower, vision::Side::kUpper}) {
    table.add(fmt::format("{} frames lost", to_string(view)), Cause::kFramesLost, view, "lost", "%", "lost-percent");
  }
}

}  // namespace

const std::vector<LimitKind>& limit_kinds() {
  static const std::vector<LimitKind> kinds{
      {"rim-px", 1, "radius of either rim"},
      {"centre-px", 1, "column and row of either centre"},
      {"gain", 0.05, "brightness factor of each colour, difference from 1"},
      {"noise-grey", 1, "noise at mid grey"},
      {"blur-px", 0.3, "spread of edges"},
      {"edges-px", 0.5, "error of landmarks' edges under the believed rig, rms"},
      {"missed-percent", 10, "landmarks missed"},
      {"false-percent", 1, "wrong ranges of the real run"},
      {"fix-percent", 2, "frames with a fix"},
      {"disparity-px", 0.5, "error of disparities against the reference, rms"},
      {"range-mm", 20, "error of ranges against the reference, rms"},
      {"bearing-deg", 0.3, "error of bearings against the reference, rms"},
      {"fix-mm", 20, "error of fixes against the reference, rms"},
      {"odometry-mm-per-m", 10, "error of odometry over a metre, rms"},
      {"ape-mm", 200, "distance of paths at equal times, rms"},
      {"ape-aligned-mm", 100, "the same, aligned"},
      {"rate-percent", 1, "frame rate"},
      {"jitter-ms", 5, "jitter of a frame's time"},
      {"skew-ms", 5, "skew, stamped and beyond the stamps"},
      {"latency-ms", 20, "age of images at their stamps"},
      {"lost-percent", 1, "frames lost"},
  };
  return kinds;
}

Light light_of(double gap, std::optional<double> sigma, double limit) {
  if (sigma && *sigma > limit && gap <= limit + kCertain * *sigma) return Light::kCannotTell;
  if (gap <= limit) return Light::kGreen;
  return gap <= 2 * limit ? Light::kAmber : Light::kRed;
}

std::vector<Row> find_rows(const BothRuns& runs, const Residuals& of_simulated, const Residuals& of_real,
                           const std::vector<Source>& sources, const Limits& limits) {
  Table table(limits, sources);
  add_image(table, runs.simulated, runs.real);
  add_detection(table, runs.simulated, runs.real, of_simulated, of_real, runs.by_pose);
  add_answers(table, of_simulated, of_real);
  add_trajectories(table, runs.simulated, runs.real, runs.by_time);
  add_timing(table, runs.simulated_timing, runs.real_timing);
  return table.take();
}

}  // namespace twocone::compare
