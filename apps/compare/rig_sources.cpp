// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Dense>

#include "apps/compare/source_tests.h"

namespace twocone::compare {
namespace {

/// A number of both sides with its model tolerance, before it becomes a component.
struct Number {
  const char* name;  ///< as in CalibratedParameter; for a view without the view's name
  const char* shown_unit;
  double shown_per_si;  ///< shown = SI * this
  double model_sigma;   ///< SI
};

struct Wanted {
  Cause cause;
  std::optional<vision::Side> view;
  std::vector<Number> numbers;

  [[nodiscard]] std::string full_name(const Number& number) const {
    return view ? fmt::format("{}.{}", to_string(*view), number.name) : number.name;
  }
};

std::vector<Wanted> wanted_of_rig() {
  std::vector<Wanted> all;
  for (const vision::Side view : {vision::Side::kLower, vision::Side::kUpper}) {
    all.push_back({Cause::kFocalLength, view, {{"rim_radius_px", "px", 1, kModel.rim_px}}});
    all.push_back({Cause::kCentre,
                   view,
                   {{"centre_px.column", "px", 1, kModel.centre_px}, {"centre_px.row", "px", 1, kModel.centre_px}}});
    all.push_back(
        {Cause::kTilt,
         view,
         {{"tilt_rad.x", "deg", 1 / kDegree, kModel.tilt_rad}, {"tilt_rad.y", "deg", 1 / kDegree, kModel.tilt_rad}}});
    all.push_back({Cause::kMirrorShape,
                   view,
                   {{"apex_rad", "deg", 1 / kDegree, kModel.apex_rad},
                    {"mirror_radius_m", "mm", 1e3, kModel.length_m},
                    {"lens_to_tip_m", "mm", 1e3, kModel.length_m}}});
    all.push_back({Cause::kRollingShutter, view, {{"readout_s", "ms", 1e3, 0}}});
  }
  all.push_back({Cause::kMirrorsAlignment,
                 {},
                 {{"upper.azimuth_minus_lower_rad", "deg", 1 / kDegree, kModel.azimuth_rad},
                  {"upper.axis_offset_minus_lower_m.x", "mm", 1e3, kModel.offset_m},
                  {"upper.axis_offset_minus_lower_m.y", "mm", 1e3, kModel.offset_m}}});
  all.push_back({Cause::kMirrorsHeights,
                 {},
                 {{"mirror_separation_m", "mm", 1e3, kModel.length_m}, {"lens_height_m", "mm", 1e3, kModel.length_m}}});
  all.push_back({Cause::kSkew, {}, {{"upper.skew_s", "ms", 1e3, 0}}});
  all.push_back({Cause::kLatency, {}, {{"latency_s", "ms", 1e3, 0}}});
  all.push_back({Cause::kWheelRadius, {}, {{"wheel_radius_m", "mm", 1e3, 0}}});
  all.push_back({Cause::kWheelRatio, {}, {{"wheel_ratio", "1", 1, 0}}});
  all.push_back({Cause::kWheelSeparation, {}, {{"wheel_separation_m", "mm", 1e3, 0}}});
  return all;
}

/// Returns the index of a number that the data determine.
std::optional<Eigen::Index> index_of(const vision::CalibrationResult& result, const std::string& name) {
  const auto at = std::find_if(result.parameters.begin(), result.parameters.end(),
                               [&](const vision::CalibratedParameter& p) { return p.name == name; });
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
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

}  // namespace

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
    if (!missing.empty()) {
      source.reason = fmt::format("the drive does not determine {}", fmt::join(missing, ", "));
    }
    if (found.empty()) continue;
    Eigen::VectorXd shown_per_si(Eigen::Index(found.size()));
    std::transform(found.begin(), found.end(), shown_per_si.begin(), [](const Number& n) { return n.shown_per_si; });
    Eigen::MatrixXd covariance = a.covariance(in_a, in_a) + b.covariance(in_b, in_b);
    covariance = (shown_per_si.asDiagonal() * covariance * shown_per_si.asDiagonal()).eval();
    for (std::size_t i = 0; i < found.size(); ++i) {
      const auto at = Eigen::Index(i);
      covariance(at, at) += std::pow(found[i].model_sigma * found[i].shown_per_si, 2);
      const auto shown = [&](const vision::CalibrationResult& result, Eigen::Index k) {
        return result.parameters[std::size_t(k)].after * found[i].shown_per_si;
      };
      source.components.push_back({wanted.full_name(found[i]), found[i].shown_unit, shown(a, in_a[i]),
                                   shown(b, in_b[i]), std::sqrt(covariance(at, at))});
    }
    judge(source, covariance);
    source.confusable = confusable_with(in_b, owners, b.covariance);
  }
}

}  // namespace twocone::compare
