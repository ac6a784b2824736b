// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/compare/source_tests.h"

namespace twocone::compare {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A number of both sides with its model tolerance, before it becomes a component.
struct Number {
  const char* name;  ///< as in CalibratedParameter; for a view without the view's name
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

/// Returns the sources whose numbers are almost fully correlated with those of `source` in a run's data.
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

}  // namespace

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
    std::vector<const Number*> found;
    std::string missing;
    for (const Number& number : wanted.numbers) {
      const std::string name = full_name(wanted, number);
      const auto i = index_of(a, name);
      const auto k = index_of(b, name);
      if (!i || !k) {
        missing += fmt::format("{}{} ({})", missing.empty() ? "" : ", ", name,
                               i ? "real run" : (k ? "simulated run" : "both runs"));
        continue;
      }
      in_a.push_back(*i);
      in_b.push_back(*k);
      found.push_back(&number);
    }
    if (!missing.empty()) source.reason = "the drive does not determine " + missing;
    if (found.empty()) continue;
    const auto count = Eigen::Index(found.size());
    Eigen::MatrixXd covariance(count, count);
    for (Eigen::Index r = 0; r < count; ++r) {
      const Number& number = *found[std::size_t(r)];
      for (Eigen::Index c = 0; c < count; ++c) {
        const auto ar = Eigen::Index(in_a[std::size_t(r)]), ac = Eigen::Index(in_a[std::size_t(c)]);
        const auto br = Eigen::Index(in_b[std::size_t(r)]), bc = Eigen::Index(in_b[std::size_t(c)]);
        covariance(r, c) =
            (a.covariance(ar, ac) + b.covariance(br, bc)) * number.shown_per_si * found[std::size_t(c)]->shown_per_si;
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

}  // namespace twocone::compare
