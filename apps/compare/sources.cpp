// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/sources.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/compare/source_tests.h"
#include "apps/config/to_layers.h"
#include "localisation/chi_squared.h"

namespace twocone::compare {
namespace {

// ---- slip, the map

void add_slip(const BothRuns& runs, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kSlip);
  if (runs.is_rendered) {
    source.reason = "at poses that are rendered again no wheel can slip";
    return;
  }
  const auto intervals = [](const Side& side) {
    if (!side.calibration) return std::size_t(0);
    const auto& frames = side.calibration->problem.frames;
    return std::size_t(
        std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.wheels.size() >= 2; }));
  };
  const std::size_t in_a = intervals(runs.simulated), in_b = intervals(runs.real);
  constexpr std::size_t kLeastIntervals = 10;  // the sigma is then known to about a fifth
  if (in_a < kLeastIntervals || in_b < kLeastIntervals) {
    source.reason = "too few wheel readings";
    return;
  }
  const auto slip = [](const Side& side) { return side.calibration->slip * side.calibration->result.wheel_scale; };
  const double a = slip(runs.simulated), b = slip(runs.real);
  // The reduced chi-squared of 3 n numbers has a relative scatter of sqrt(2 / 3n), and its root half of that.
  const double share = std::hypot(1 / std::sqrt(6.0 * double(in_a)), 1 / std::sqrt(6.0 * double(in_b)));
  // The wheels' rows are not independent in time: slip persists for seconds.
  constexpr double kMemory = 2;
  source.components.push_back({"slip", "%", 100 * a, 100 * b, 100 * kMemory * share * std::max((a + b) / 2, 1e-6)});
  judge(source);
}

void add_map(const Side& simulated, const Side& real, std::vector<Source>& sources) {
  for (const auto& landmark : real.run.map.landmarks) {
    Source& source = add_source(sources, Cause::kLandmark);
    source.landmark = landmark.name;
    const auto a = simulated.map_shifts.find(landmark.name), b = real.map_shifts.find(landmark.name);
    const bool is_in_real = b != real.map_shifts.end();
    if (a == simulated.map_shifts.end() || !is_in_real) {
      source.reason = fmt::format("the {} does not determine its place", is_in_real ? "simulated run" : "real run");
      continue;
    }
    const Eigen::Matrix2d covariance = 1e6 * (a->second.shift.covariance + b->second.shift.covariance +
                                              Eigen::Matrix2d::Identity() * kModel.landmark_m * kModel.landmark_m);
    for (const int axis : {0, 1}) {
      source.components.push_back({axis == 0 ? "x_m" : "y_m", "mm", 1e3 * a->second.shift.shift_m[axis],
                                   1e3 * b->second.shift.shift_m[axis], std::sqrt(covariance(axis, axis))});
    }
    judge(source, covariance);
  }
}

// ---- frames

/// Returns the loss rate that is set for a simulated camera, so that it need not be measured; nothing for a real one.
std::optional<double> set_to_lose(const Side& side, vision::Side view) {
  if (!config::is_simulated(side.run.robot)) return std::nullopt;
  return (view == vision::Side::kLower ? side.run.robot.lower : side.run.robot.upper).effects.drop_probability;
}

void add_lost(const BothRuns& runs, vision::Side view, std::vector<Source>& sources) {
  const Timing &a = runs.simulated_timing, &b = runs.real_timing;
  const auto k = static_cast<std::size_t>(view);
  Source& source = add_source(sources, Cause::kFramesLost, view);
  const auto share = [k](const Timing& t) { return double(t.lost[k]) / double(t.all[k]); };
  const auto variance = [&](const Timing& t) {
    // The variance of a share with one more of either kind, which is never 0.
    const double p = (double(t.lost[k]) + 1) / (double(t.all[k]) + 2);
    return p * (1 - p) / double(t.all[k]);
  };
  if (const auto set = set_to_lose(runs.simulated, view)) {
    source.components.push_back({"lost", "%", 100 * *set, 100 * share(b), 100 * std::sqrt(variance(b))});
    source.p_value = lost_p_value(b.lost[k], b.all[k], *set);
  } else {
    source.components.push_back(
        {"lost", "%", 100 * share(a), 100 * share(b), 100 * std::sqrt(variance(a) + variance(b))});
    source.p_value = lost_p_value(a.lost[k], a.all[k], b.lost[k], b.all[k]);
  }
  source.chi_squared = std::pow(source.components[0].difference() / source.components[0].sigma, 2);
}

void add_stamps(const Timing& a, const Timing& b, std::vector<Source>& sources) {
  Source& rate = add_source(sources, Cause::kFrameRate);
  if (a.rate_hz > 0 && b.rate_hz > 0) {
    rate.components.push_back({"rate_hz", "Hz", a.rate_hz, b.rate_hz, kModel.rate_share * b.rate_hz});
    judge(rate);
  } else {
    rate.reason = "no two frames follow each other without loss";
  }
  Source& stamped = add_source(sources, Cause::kStampedSkew);
  constexpr double kStep_s = 1e-6;  // resolution of a stamp
  stamped.components.push_back(
      {"skew_s", "ms", 1e3 * a.skew_s, 1e3 * b.skew_s, 1e3 * std::hypot(a.skew_sigma_s, b.skew_sigma_s, kStep_s)});
  judge(stamped);
}

}  // namespace

Source& add_source(std::vector<Source>& sources, Cause cause, std::optional<vision::Side> view) {
  sources.push_back({.cause = cause, .view = view});
  return sources.back();
}

void judge(Source& source, const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd difference(Eigen::Index(source.components.size()));
  std::transform(source.components.begin(), source.components.end(), difference.begin(),
                 [](const Component& c) { return c.difference(); });
  source.chi_squared = difference.dot(covariance.ldlt().solve(difference));
  source.p_value = localisation::chi_squared_tail(source.chi_squared, int(difference.size()));
}

void judge(Source& source) {
  Eigen::VectorXd variances(Eigen::Index(source.components.size()));
  std::transform(source.components.begin(), source.components.end(), variances.begin(),
                 [](const Component& c) { return c.sigma * c.sigma; });
  judge(source, variances.asDiagonal());
}

std::vector<Source> find_sources(const BothRuns& runs, const Images& images, double false_alarm, double& level) {
  std::vector<Source> sources;
  add_rig_sources(runs.simulated, runs.real, sources);
  add_slip(runs, sources);
  add_map(runs.simulated, runs.real, sources);
  for (const vision::Side view : {vision::Side::kLower, vision::Side::kUpper}) {
    add_image_sources(images.views[static_cast<std::size_t>(view)], view, sources);
    add_lost(runs, view, sources);
  }
  add_stamps(runs.simulated_timing, runs.real_timing, sources);
  const auto tested =
      std::count_if(sources.begin(), sources.end(), [](const Source& s) { return !s.components.empty(); });
  level = false_alarm / double(std::max<std::ptrdiff_t>(1, tested));
  for (Source& source : sources) {
    if (source.components.empty()) continue;
    source.verdict = source.p_value < level ? SourceVerdict::kDiffers : SourceVerdict::kAgrees;
  }
  return sources;
}

}  // namespace twocone::compare
