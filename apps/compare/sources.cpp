// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Dense>

#include "apps/config/to_layers.h"
#include "base/quantile.h"
#include "localisation/chi_squared.h"

namespace twocone::compare {
namespace {

constexpr ModelSigmas kModel;

/// Adds a source without numbers. @param view for a cause of one view
Source& add_source(std::vector<Source>& sources, Cause cause, std::optional<vision::Side> view = std::nullopt) {
  return sources.emplace_back(Source{.cause = cause, .view = view});
}

/// Sets chi-squared and p-value of the components' differences under `covariance`, in the components' own units.
void judge(Source& source, const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd difference(Eigen::Index(source.components.size()));
  std::ranges::transform(source.components, difference.begin(), &Component::difference);
  source.chi_squared = difference.dot(covariance.ldlt().solve(difference));
  source.p_value = localisation::chi_squared_tail(source.chi_squared, int(difference.size()));
}

/// Sets chi-squared and p-value for components without correlation.
void judge(Source& source) {
  Eigen::VectorXd variances(Eigen::Index(source.components.size()));
  std::ranges::transform(source.components, variances.begin(), [](const Component& c) { return c.sigma * c.sigma; });
  judge(source, variances.asDiagonal());
}

// ---- the two calibrations

/// A number of the calibration that is a part of a source.
struct Number {
  Cause cause;
  const char* name;  ///< as in CalibratedParameter; for a number of one view, without the view's name
  const char* shown_unit;
  double shown_per_si;  ///< shown = SI * this
  double model_sigma;   ///< SI
};
constexpr std::array kNumbersOfView{
    Number{Cause::kFocalLength, "rim_radius_px", "px", 1, kModel.rim_px},
    Number{Cause::kCentre, "centre_px.column", "px", 1, kModel.centre_px},
    Number{Cause::kCentre, "centre_px.row", "px", 1, kModel.centre_px},
    Number{Cause::kTilt, "tilt_rad.x", "deg", 1 / kDegree, kModel.tilt_rad},
    Number{Cause::kTilt, "tilt_rad.y", "deg", 1 / kDegree, kModel.tilt_rad},
    Number{Cause::kMirrorShape, "apex_rad", "deg", 1 / kDegree, kModel.apex_rad},
    Number{Cause::kMirrorShape, "mirror_radius_m", "mm", 1e3, kModel.length_m},
    Number{Cause::kMirrorShape, "lens_to_tip_m", "mm", 1e3, kModel.length_m},
    Number{Cause::kRollingShutter, "readout_s", "ms", 1e3, 0},
};
constexpr std::array kNumbersOfRobot{
    Number{Cause::kMirrorsAlignment, "upper.azimuth_minus_lower_rad", "deg", 1 / kDegree, kModel.azimuth_rad},
    Number{Cause::kMirrorsAlignment, "upper.axis_offset_minus_lower_m.x", "mm", 1e3, kModel.offset_m},
    Number{Cause::kMirrorsAlignment, "upper.axis_offset_minus_lower_m.y", "mm", 1e3, kModel.offset_m},
    Number{Cause::kMirrorsHeights, "mirror_separation_m", "mm", 1e3, kModel.length_m},
    Number{Cause::kMirrorsHeights, "lens_height_m", "mm", 1e3, kModel.length_m},
    Number{Cause::kSkew, "upper.skew_s", "ms", 1e3, 0},
    Number{Cause::kLatency, "latency_s", "ms", 1e3, 0},
    Number{Cause::kWheelRadius, "wheel_radius_m", "mm", 1e3, 0},
    Number{Cause::kWheelRatio, "wheel_ratio", "1", 1, 0},
    Number{Cause::kWheelSeparation, "wheel_separation_m", "mm", 1e3, 0},
};

struct Wanted {
  Cause cause;
  std::optional<vision::Side> view;
  std::vector<Number> numbers{};

  [[nodiscard]] std::string full_name(const Number& number) const {
    return view ? fmt::format("{}.{}", to_string(*view), number.name) : number.name;
  }
};

std::vector<Wanted> wanted_of_rig() {
  std::vector<Wanted> all;
  const auto add = [&all](std::optional<vision::Side> view, std::span<const Number> numbers) {
    for (const Number& number : numbers) {
      if (all.empty() || all.back().cause != number.cause) all.push_back({number.cause, view});
      all.back().numbers.push_back(number);
    }
  };
  add(vision::Side::kLower, kNumbersOfView);
  add(vision::Side::kUpper, kNumbersOfView);
  add(std::nullopt, kNumbersOfRobot);
  return all;
}

/// Returns the index of a number, or nothing if the data do not determine it.
std::optional<Eigen::Index> index_of(const vision::CalibrationResult& result, const std::string& name) {
  const auto at = std::ranges::find(result.parameters, name, &vision::CalibratedParameter::name);
  if (at == result.parameters.end() || !at->observed) return std::nullopt;
  return at - result.parameters.begin();
}

/// Returns the names of the sources whose numbers are almost fully correlated in a run's data with those at `own`.
/// @param owners the source of each number of the calibration; null: none
std::vector<std::string> confusable_with(const std::vector<Eigen::Index>& own, const std::vector<const Wanted*>& owners,
                                         const Eigen::MatrixXd& covariance) {
  std::vector<std::string> names;
  for (const Eigen::Index i : own) {
    for (Eigen::Index k = 0; k < std::ssize(owners); ++k) {
      const Wanted* const other = owners[std::size_t(k)];
      if (!other || other == owners[std::size_t(i)]) continue;
      const double correlation = covariance(i, k) / std::sqrt(covariance(i, i) * covariance(k, k));
      if (!(std::abs(correlation) > kConfusable)) continue;
      const std::string name = Source{.cause = other->cause, .view = other->view}.name();
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

/// Adds the sources of the two calibrations: views, alignment, exposure times, wheels.
void add_rig_sources(const Side& simulated, const Side& real, std::vector<Source>& sources) {
  const std::vector<Wanted> all = wanted_of_rig();
  if (!simulated.calibration || !real.calibration) {
    const Side& without = simulated.calibration ? real : simulated;
    for (const Wanted& wanted : all) add_source(sources, wanted.cause, wanted.view).reason = without.why_no_calibration;
    return;
  }
  const vision::CalibrationResult& a = simulated.calibration->result;
  const vision::CalibrationResult& b = real.calibration->result;
  std::vector<const Wanted*> owners(b.parameters.size());
  for (const Wanted& wanted : all) {
    for (const Number& number : wanted.numbers) {
      if (const auto i = index_of(b, wanted.full_name(number))) owners[std::size_t(*i)] = &wanted;
    }
  }
  for (const Wanted& wanted : all) {
    Source& source = add_source(sources, wanted.cause, wanted.view);
    std::vector<Eigen::Index> in_a, in_b;
    std::vector<Number> found;
    std::vector<std::string> missing;
    for (const Number& number : wanted.numbers) {
      const std::string name = wanted.full_name(number);
      const auto i = index_of(a, name);
      const auto k = index_of(b, name);
      if (!i || !k) {
        missing.push_back(fmt::format("{} ({})", name, i ? "real run" : (k ? "simulated run" : "both runs")));
        continue;
      }
      in_a.push_back(*i);
      in_b.push_back(*k);
      found.push_back(number);
    }
    if (!missing.empty()) source.reason = fmt::format("the drive does not determine {}", fmt::join(missing, ", "));
    if (found.empty()) continue;
    Eigen::VectorXd shown_per_si(Eigen::Index(found.size()));
    std::ranges::transform(found, shown_per_si.begin(), &Number::shown_per_si);
    Eigen::MatrixXd covariance = a.covariance(in_a, in_a) + b.covariance(in_b, in_b);
    covariance = (shown_per_si.asDiagonal() * covariance * shown_per_si.asDiagonal()).eval();
    for (std::size_t i = 0; i < found.size(); ++i) {
      const auto at = Eigen::Index(i);
      covariance(at, at) += std::pow(found[i].model_sigma * found[i].shown_per_si, 2);
      const double was = a.parameters[std::size_t(in_a[i])].after, is = b.parameters[std::size_t(in_b[i])].after;
      source.components.push_back({wanted.full_name(found[i]), found[i].shown_unit, was * found[i].shown_per_si,
                                   is * found[i].shown_per_si, std::sqrt(covariance(at, at))});
    }
    judge(source, covariance);
    source.confusable = confusable_with(in_b, owners, b.covariance);
  }
}

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
    return std::size_t(std::ranges::count_if(frames, [](const auto& frame) { return frame.wheels.size() >= 2; }));
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

/// Returns the mean of a series. Its sigma comes from the scatter of the means of kStretches parts, because neighbours
/// are correlated. For a short series, it is the standard deviation of one value.
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
  // If only a few tiles are found and these are not uniform, the sigma is some grey levels.
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

/// Returns the loss rate that is set for a simulated camera, which makes a measurement unnecessary; nothing for a real
/// camera.
std::optional<double> set_to_lose(const Side& side, vision::Side view) {
  if (!config::is_simulated(side.run.robot)) return std::nullopt;
  return of_view(side.run.robot, view).effects.drop_probability;
}

void add_lost(const BothRuns& runs, vision::Side view, std::vector<Source>& sources) {
  const Timing &a = runs.simulated_timing, &b = runs.real_timing;
  const auto k = std::size_t(view);
  Source& source = add_source(sources, Cause::kFramesLost, view);
  const auto share = [k](const Timing& t) { return double(t.lost[k]) / double(t.all[k]); };
  const auto variance = [&](const Timing& t) {
    // The variance of a share after adding one lost and one received frame, which is never 0.
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

std::vector<Source> find_sources(const BothRuns& runs, const Images& images, double false_alarm, double& level) {
  std::vector<Source> sources;
  add_rig_sources(runs.simulated, runs.real, sources);
  add_slip(runs, sources);
  add_map(runs.simulated, runs.real, sources);
  for (const vision::Side view : {vision::Side::kLower, vision::Side::kUpper}) {
    const ViewImages& of_view = images.views[std::size_t(view)];
    add_gain(of_view, view, sources);
    add_noise(of_view, view, sources);
    add_blur(of_view, view, sources);
    add_lost(runs, view, sources);
  }
  add_stamps(runs.simulated_timing, runs.real_timing, sources);
  const auto tested = std::ranges::count_if(sources, [](const Source& s) { return !s.components.empty(); });
  level = false_alarm / double(std::max<std::ptrdiff_t>(1, tested));
  for (Source& source : sources) {
    if (source.components.empty()) continue;
    source.verdict = source.p_value < level ? SourceVerdict::kDiffers : SourceVerdict::kAgrees;
  }
  return sources;
}

}  // namespace twocone::compare
