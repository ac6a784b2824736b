// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/sources.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/files/to_layers.h"
#include "apps/runs/quantile.h"
#include "localisation/chi_squared.h"

namespace twocone::compare {
namespace {

constexpr ModelSigmas kModel;
constexpr double kDegree = std::numbers::pi / 180;

/// A number of both sides with what the model allows it, before it is a component.
struct Number {
  const char* name;  ///< as CalibratedParameter has it, a view's without the view
  const char* shown_unit;
  double shown_per_si;  ///< shown = SI * this
  double model_sigma;   ///< SI
};

struct Wanted {
  const char* kind;
  const char* where;
  std::vector<Number> numbers;
};

std::vector<Wanted> wanted_of_rig() {
  std::vector<Wanted> all;
  for (const char* const view : {"lower", "upper"}) {
    all.push_back({"focal length", view, {{"rim_radius_px", "px", 1, kModel.rim_px}}});
    all.push_back({"centre",
                   view,
                   {{"centre_px.column", "px", 1, kModel.centre_px}, {"centre_px.row", "px", 1, kModel.centre_px}}});
    all.push_back(
        {"tilt",
         view,
         {{"tilt_rad.x", "deg", 1 / kDegree, kModel.tilt_rad}, {"tilt_rad.y", "deg", 1 / kDegree, kModel.tilt_rad}}});
    all.push_back({"mirror shape",
                   view,
                   {{"apex_rad", "deg", 1 / kDegree, kModel.apex_rad},
                    {"mirror_radius_m", "mm", 1e3, kModel.length_m},
                    {"lens_to_tip_m", "mm", 1e3, kModel.length_m}}});
    all.push_back({"rolling shutter", view, {{"readout_s", "ms", 1e3, 0}}});
  }
  all.push_back({"mirrors' alignment",
                 "",
                 {{"upper.azimuth_minus_lower_rad", "deg", 1 / kDegree, kModel.azimuth_rad},
                  {"upper.axis_offset_minus_lower_m.x", "mm", 1e3, kModel.offset_m},
                  {"upper.axis_offset_minus_lower_m.y", "mm", 1e3, kModel.offset_m}}});
  all.push_back({"mirrors' heights",
                 "",
                 {{"mirror_separation_m", "mm", 1e3, kModel.length_m}, {"lens_height_m", "mm", 1e3, kModel.length_m}}});
  all.push_back({"skew", "", {{"upper.skew_s", "ms", 1e3, 0}}});
  all.push_back({"latency", "", {{"latency_s", "ms", 1e3, 0}}});
  all.push_back({"wheel radius", "", {{"wheel_radius_m", "mm", 1e3, 0}}});
  all.push_back({"wheel ratio", "", {{"wheel_ratio", "1", 1, 0}}});
  all.push_back({"wheel separation", "", {{"wheel_separation_m", "mm", 1e3, 0}}});
  return all;
}

std::string full_name(const Wanted& wanted, const Number& number) {
  return *wanted.where == '\0' ? number.name : fmt::format("{}.{}", wanted.where, number.name);
}

std::optional<std::size_t> index_of(const vision::CalibrationResult& result, const std::string& name) {
  const auto at = std::find_if(result.parameters.begin(), result.parameters.end(),
                               [&](const vision::CalibratedParameter& p) { return p.name == name; });
  if (at == result.parameters.end() || !at->observed) return std::nullopt;
  return std::size_t(at - result.parameters.begin());
}

/// chi-squared and its tail of the differences under `covariance`, in the components' own units.
void judge(Source& source, const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd difference(Eigen::Index(source.components.size()));
  for (Eigen::Index i = 0; i < difference.size(); ++i) {
    difference[i] = source.components[std::size_t(i)].difference();
  }
  source.chi_squared = difference.dot(covariance.ldlt().solve(difference));
  source.p_value = localisation::chi_squared_tail(source.chi_squared, int(difference.size()));
}

/// The same for components that do not hang together.
void judge(Source& source) {
  Eigen::VectorXd variances(Eigen::Index(source.components.size()));
  for (Eigen::Index i = 0; i < variances.size(); ++i) {
    variances[i] = source.components[std::size_t(i)].sigma * source.components[std::size_t(i)].sigma;
  }
  judge(source, variances.asDiagonal());
}

/// Sources whose numbers hang together with those of `source` in a run's data, one for one.
std::vector<std::string> confusable_with(const std::vector<std::size_t>& own, const std::vector<std::string>& owners,
                                         const Eigen::MatrixXd& covariance) {
  std::vector<std::string> names;
  for (const std::size_t i : own) {
    for (std::size_t k = 0; k < owners.size(); ++k) {
      if (owners[k].empty() || owners[k] == owners[i]) continue;
      const auto a = Eigen::Index(i), b = Eigen::Index(k);
      const double correlation = covariance(a, b) / std::sqrt(covariance(a, a) * covariance(b, b));
      if (!(std::abs(correlation) > kConfusable)) continue;
      if (std::find(names.begin(), names.end(), owners[k]) == names.end()) names.push_back(owners[k]);
    }
  }
  return names;
}

void add_rig_sources(const Side& simulated, const Side& real, std::vector<Source>& sources) {
  const std::vector<Wanted> all = wanted_of_rig();
  if (!simulated.calibration || !real.calibration) {
    const Side& without = simulated.calibration ? real : simulated;
    for (const Wanted& wanted : all) {
      Source& source = sources.emplace_back();
      source.kind = wanted.kind;
      source.where = wanted.where;
      source.reason = without.why_no_calibration;
    }
    return;
  }
  const vision::CalibrationResult& a = simulated.calibration->result;
  const vision::CalibrationResult& b = real.calibration->result;
  std::vector<std::string> owners(b.parameters.size());
  for (const Wanted& wanted : all) {
    for (const Number& number : wanted.numbers) {
      if (const auto i = index_of(b, full_name(wanted, number))) {
        owners[*i] = *wanted.where == '\0' ? wanted.kind : fmt::format("{} {}", wanted.where, wanted.kind);
      }
    }
  }
  for (const Wanted& wanted : all) {
    Source& source = sources.emplace_back();
    source.kind = wanted.kind;
    source.where = wanted.where;
    std::vector<std::size_t> in_a, in_b;
    std::vector<const Number*> told;
    std::string untold;
    for (const Number& number : wanted.numbers) {
      const std::string name = full_name(wanted, number);
      const auto i = index_of(a, name);
      const auto k = index_of(b, name);
      if (!i || !k) {
        untold += fmt::format("{}{} ({})", untold.empty() ? "" : ", ", name,
                              i ? "real run" : (k ? "simulated run" : "both runs"));
        continue;
      }
      in_a.push_back(*i);
      in_b.push_back(*k);
      told.push_back(&number);
    }
    if (!untold.empty()) source.reason = "the drive does not tell " + untold;
    if (told.empty()) continue;
    const auto count = Eigen::Index(told.size());
    Eigen::MatrixXd covariance(count, count);
    for (Eigen::Index r = 0; r < count; ++r) {
      const Number& number = *told[std::size_t(r)];
      for (Eigen::Index c = 0; c < count; ++c) {
        const auto ar = Eigen::Index(in_a[std::size_t(r)]), ac = Eigen::Index(in_a[std::size_t(c)]);
        const auto br = Eigen::Index(in_b[std::size_t(r)]), bc = Eigen::Index(in_b[std::size_t(c)]);
        covariance(r, c) =
            (a.covariance(ar, ac) + b.covariance(br, bc)) * number.shown_per_si * told[std::size_t(c)]->shown_per_si;
      }
      covariance(r, r) += std::pow(number.model_sigma * number.shown_per_si, 2);
      source.components.push_back(
          {full_name(wanted, number), number.shown_unit, a.parameters[in_a[std::size_t(r)]].after * number.shown_per_si,
           b.parameters[in_b[std::size_t(r)]].after * number.shown_per_si, std::sqrt(covariance(r, r))});
    }
    judge(source, covariance);
    source.confusable = confusable_with(in_b, owners, b.covariance);
  }
}

// ---- slip, the map

void add_slip(const Side& simulated, const Side& real, bool is_rendered, std::vector<Source>& sources) {
  Source& source = sources.emplace_back();
  source.kind = "slip";
  if (is_rendered) {
    source.reason = "places that are rendered again have no wheels that could slip";
    return;
  }
  const auto intervals = [](const Side& side) {
    if (!side.calibration) return std::size_t(0);
    const auto& frames = side.calibration->problem.frames;
    return std::size_t(
        std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.wheels.size() >= 2; }));
  };
  const std::size_t in_a = intervals(simulated), in_b = intervals(real);
  constexpr std::size_t kLeastIntervals = 10;  // a sigma of a sigma of a fifth or so
  if (in_a < kLeastIntervals || in_b < kLeastIntervals) {
    source.reason = "too few wheel readings";
    return;
  }
  const auto slip = [](const Side& side) { return side.calibration->slip * side.calibration->result.wheel_scale; };
  const double a = slip(simulated), b = slip(real);
  // Reduced chi-squared of 3 n numbers scatters by sqrt(2 / 3n) of itself, its root by half of that.
  const double share = std::hypot(1 / std::sqrt(6.0 * double(in_a)), 1 / std::sqrt(6.0 * double(in_b)));
  // The wheels' rows are not independent in time: slip is remembered for seconds.
  constexpr double kMemory = 2;
  source.components.push_back({"slip", "%", 100 * a, 100 * b, 100 * kMemory * share * std::max((a + b) / 2, 1e-6)});
  judge(source);
}

void add_map(const Side& simulated, const Side& real, std::vector<Source>& sources) {
  for (const auto& landmark : real.run.map.landmarks) {
    Source& source = sources.emplace_back();
    source.kind = "landmark";
    source.where = landmark.name;
    const auto shift = [&](const Side& side) -> const vision::RelativeShift* {
      for (const auto& s : side.map_shifts) {
        if (s.first == landmark.name) return &s.second;
      }
      return nullptr;
    };
    const auto* const a = shift(simulated);
    const auto* const b = shift(real);
    if (!a || !b) {
      source.reason = fmt::format("the {} does not tell its place", b ? "simulated run" : "real run");
      continue;
    }
    const Eigen::Matrix2d covariance = 1e6 * (a->shift.covariance + b->shift.covariance +
                                              Eigen::Matrix2d::Identity() * kModel.landmark_m * kModel.landmark_m);
    for (const int axis : {0, 1}) {
      source.components.push_back({axis == 0 ? "x_m" : "y_m", "mm", 1e3 * a->shift.shift_m[axis],
                                   1e3 * b->shift.shift_m[axis], std::sqrt(covariance(axis, axis))});
    }
    judge(source, covariance);
  }
}

// ---- pictures

struct MeanSigma {
  double mean = 0, sigma = 0;
};

/// Of a series: its mean, with the scatter of the means of kStretches stretches of it, as neighbours are alike.
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

void add_gain(const ViewPictures& view, const char* where, std::vector<Source>& sources) {
  Source& source = sources.emplace_back();
  source.kind = "exposure and colour";
  source.where = where;
  constexpr std::size_t kLeastPairs = 3;
  if (view.transfers.size() < kLeastPairs) {
    source.reason =
        fmt::format("{} pairs of pictures show about the same, it takes {}", view.transfers.size(), kLeastPairs);
    return;
  }
  const auto series = [&](const auto& of) {
    std::vector<double> values;
    for (const vision::Transfer& t : view.transfers) values.push_back(of(t));
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

void add_noise(const ViewPictures& view, const char* where, std::vector<Source>& sources) {
  Source& source = sources.emplace_back();
  source.kind = "noise";
  source.where = where;
  const auto a = vision::fit_noise(view.simulated_noise);
  const auto b = vision::fit_noise(view.real_noise);
  // Some grey levels of uncertainty are those of a few tiles that are none too plain.
  constexpr double kMostSigma_grey = 1;
  const auto is_told = [](const auto& noise) { return noise && noise->sigma_noise_grey <= kMostSigma_grey; };
  if (!is_told(a) || !is_told(b)) {
    source.reason = fmt::format("the {} pictures have too few plain places", is_told(b) ? "simulated" : "real");
    return;
  }
  source.components.push_back(
      {"noise", "grey", a->noise_grey, b->noise_grey, std::hypot(a->sigma_noise_grey, b->sigma_noise_grey)});
  judge(source);
}

void add_blur(const ViewPictures& view, const char* where, std::vector<Source>& sources) {
  Source& source = sources.emplace_back();
  source.kind = "sharpness";
  source.where = where;
  if (view.simulated_blur_px.empty() || view.real_blur_px.empty()) {
    source.reason =
        fmt::format("the {} pictures have no sharp edges", view.real_blur_px.empty() ? "real" : "simulated");
    return;
  }
  const auto sigma = [](const std::vector<double>& values) { return mean_of(values).sigma; };
  source.components.push_back({"blur", "px", runs::quantile(view.simulated_blur_px, 0.5),
                               runs::quantile(view.real_blur_px, 0.5),
                               std::hypot(sigma(view.simulated_blur_px), sigma(view.real_blur_px), kModel.blur_px)});
  judge(source);
}

// ---- frames

/// What a simulated camera is set to lose, which is known and not to be measured; nothing of a real one.
std::optional<double> set_to_lose(const Side& side, std::size_t view) {
  if (!files::is_simulated(side.run.robot)) return std::nullopt;
  return (view == 0 ? side.run.robot.lower : side.run.robot.upper).effects.drop_probability;
}

void add_lost(const Side& simulated, const Timing& a, const Timing& b, std::size_t view, const char* where,
              std::vector<Source>& sources) {
  Source& source = sources.emplace_back();
  source.kind = "frames lost";
  source.where = where;
  const auto share = [view](const Timing& t) { return double(t.lost[view]) / double(t.all[view]); };
  const auto variance = [&](const Timing& t) {
    // Of a share with one more of either kind, which is never 0.
    const double p = (double(t.lost[view]) + 1) / (double(t.all[view]) + 2);
    return p * (1 - p) / double(t.all[view]);
  };
  if (const auto set = set_to_lose(simulated, view)) {
    source.components.push_back({"lost", "%", 100 * *set, 100 * share(b), 100 * std::sqrt(variance(b))});
    source.p_value = lost_p_value(b.lost[view], b.all[view], *set);
  } else {
    source.components.push_back(
        {"lost", "%", 100 * share(a), 100 * share(b), 100 * std::sqrt(variance(a) + variance(b))});
    source.p_value = lost_p_value(a.lost[view], a.all[view], b.lost[view], b.all[view]);
  }
  source.chi_squared = std::pow(source.components[0].difference() / source.components[0].sigma, 2);
}

void add_stamps(const Timing& a, const Timing& b, std::vector<Source>& sources) {
  Source& rate = sources.emplace_back();
  rate.kind = "frame rate";
  if (a.rate_hz > 0 && b.rate_hz > 0) {
    rate.components.push_back({"rate_hz", "Hz", a.rate_hz, b.rate_hz, kModel.rate_share * b.rate_hz});
    judge(rate);
  } else {
    rate.reason = "no two frames follow each other without loss";
  }
  Source& stamped = sources.emplace_back();
  stamped.kind = "stamped skew";
  constexpr double kStep_s = 1e-6;  // of a stamp
  stamped.components.push_back(
      {"skew_s", "ms", 1e3 * a.skew_s, 1e3 * b.skew_s, 1e3 * std::hypot(a.skew_sigma_s, b.skew_sigma_s, kStep_s)});
  judge(stamped);
}

}  // namespace

std::vector<Source> find_sources(const Side& simulated, const Side& real, const Pictures& pictures,
                                 const Timing& simulated_timing, const Timing& real_timing, bool is_rendered,
                                 double false_alarm, double& level) {
  std::vector<Source> sources;
  add_rig_sources(simulated, real, sources);
  add_slip(simulated, real, is_rendered, sources);
  add_map(simulated, real, sources);
  for (const std::size_t view : {0, 1}) {
    const char* const where = view == 0 ? "lower" : "upper";
    add_gain(pictures.views[view], where, sources);
    add_noise(pictures.views[view], where, sources);
    add_blur(pictures.views[view], where, sources);
    add_lost(simulated, simulated_timing, real_timing, view, where, sources);
  }
  add_stamps(simulated_timing, real_timing, sources);
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
