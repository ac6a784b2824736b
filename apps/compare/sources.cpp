// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/sources.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/compare/source_tests.h"
#include "apps/config/to_layers.h"
#include "base/quantile.h"
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

// ---- images

struct MeanSigma {
  double mean = 0, sigma = 0;
};

/// Returns the mean of a series. Its sigma is from the scatter of the means of kStretches parts, because neighbours are
/// correlated.
MeanSigma mean_of(const std::vector<double>& series) {
  constexpr std::size_t kStretches = 8;
  MeanSigma result;
  for (const double value : series) result.mean += value / double(series.size());
  if (series.size() < 2 * kStretches) {
    for (const double value : series) result.sigma += (value - result.mean) * (value - result.mean);
    result.sigma = std::sqrt(result.sigma / double(std::max<std::size_t>(1, series.size() - 1)));
    return result;
  }
  for (std::size_t k = 0; k < kStretches; ++k) {
    const std::size_t from = k * series.size() / kStretches, to = (k + 1) * series.size() / kStretches;
    double mean = 0;
    for (std::size_t i = from; i < to; ++i) mean += series[i] / double(to - from);
    result.sigma += (mean - result.mean) * (mean - result.mean);
  }
  result.sigma = std::sqrt(result.sigma / double(kStretches * (kStretches - 1)));
  return result;
}

void add_gain(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kExposureAndColour, view);
  constexpr std::size_t kLeastPairs = 3;
  if (images.transfers.size() < kLeastPairs) {
    source.reason = fmt::format("{} pairs of images show nearly the same view, but {} are needed",
                                images.transfers.size(), kLeastPairs);
    return;
  }
  const auto series = [&](const auto& of) {
    std::vector<double> values;
    for (const vision::Transfer& t : images.transfers) values.push_back(of(t));
    return mean_of(values);
  };
  constexpr std::array<const char*, 3> kNames{"gain.red", "gain.green", "gain.blue"};
  for (std::size_t c = 0; c < kNames.size(); ++c) {
    const MeanSigma log_gain = series([c](const vision::Transfer& t) { return t.log_gain[c]; });
    const double gain = std::exp(log_gain.mean);
    source.components.push_back({kNames[c], "1", 1, gain, gain * std::hypot(log_gain.sigma, kModel.log_gain)});
  }
  const MeanSigma vignetting = series([](const vision::Transfer& t) { return t.vignetting; });
  source.components.push_back({"vignetting", "1", 0, vignetting.mean, std::hypot(vignetting.sigma, kModel.vignetting)});
  judge(source);
}

void add_noise(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kNoise, view);
  const auto a = vision::fit_noise(images.simulated_noise);
  const auto b = vision::fit_noise(images.real_noise);
  // An uncertainty of some grey levels comes from a few tiles that are not uniform.
  constexpr double kMostSigma_grey = 1;
  const auto is_determined = [](const auto& noise) { return noise && noise->sigma_noise_grey <= kMostSigma_grey; };
  if (!is_determined(a) || !is_determined(b)) {
    source.reason = fmt::format("the {} images have too few uniform areas", is_determined(b) ? "simulated" : "real");
    return;
  }
  source.components.push_back(
      {"noise", "grey", a->noise_grey, b->noise_grey, std::hypot(a->sigma_noise_grey, b->sigma_noise_grey)});
  judge(source);
}

void add_blur(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kSharpness, view);
  if (images.simulated_blur_px.empty() || images.real_blur_px.empty()) {
    source.reason =
        fmt::format("the {} images have no sharp edges", images.real_blur_px.empty() ? "real" : "simulated");
    return;
  }
  const auto sigma = [](const std::vector<double>& values) { return mean_of(values).sigma; };
  source.components.push_back(
      {"blur", "px", base::quantile(images.simulated_blur_px, 0.5), base::quantile(images.real_blur_px, 0.5),
       std::hypot(sigma(images.simulated_blur_px), sigma(images.real_blur_px), kModel.blur_px)});
  judge(source);
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
    const ViewImages& of_view = images.views[static_cast<std::size_t>(view)];
    add_gain(of_view, view, sources);
    add_noise(of_view, view, sources);
    add_blur(of_view, view, sources);
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
