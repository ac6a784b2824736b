// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/answer.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Cholesky>

#include "vision/calibration/projection.h"

namespace twocone::vision::calibration {
namespace {

// The posterior's sigma over the prior's where data and prior have equal weight: 1 / sqrt(2).
constexpr double kObservedShare = 0.70710678118654752;

std::vector<int> all_but(const std::vector<int>& held, Eigen::Index size) {
  std::vector<int> free;
  for (int i = 0; i < int(size); ++i) {
    if (std::find(held.begin(), held.end(), i) == held.end()) free.push_back(i);
  }
  return free;
}

/// A parameter that is computed from the shared numbers.
struct Derived {
  std::string name;
  std::function<double(const Shared&)> value;
};

std::vector<Derived> derived_numbers(bool has_wheels) {
  const auto upper = [](double ViewNumbers<double>::*number) {
    return [number](const Shared& s) { return view_numbers(s.data(), Side::kUpper).*number; };
  };
  const auto focal = [](Side side) {
    return [side](const Shared& s) { return focal_length(view_numbers(s.data(), side)); };
  };
  std::vector<Derived> all{{"upper.azimuth_rad", upper(&ViewNumbers<double>::azimuth)},
                           {"upper.axis_offset_m.x", upper(&ViewNumbers<double>::offset_x)},
                           {"upper.axis_offset_m.y", upper(&ViewNumbers<double>::offset_y)},
                           {"lower.focal_length_px", focal(Side::kLower)},
                           {"upper.focal_length_px", focal(Side::kUpper)}};
  if (has_wheels) {
    all.push_back({"left_wheel_radius_m", [](const Shared& s) { return 2 * s[kWheelRadius] / (1 + s[kWheelRatio]); }});
    all.push_back({"right_wheel_radius_m",
                   [](const Shared& s) { return 2 * s[kWheelRadius] * s[kWheelRatio] / (1 + s[kWheelRatio]); }});
  }
  return all;
}

/// The gradient by the unknowns. The functions are smooth over a prior's sigma, so central differences over a
/// thousandth of it are exact to some 1e-6, relatively.
Shared gradient(const Derived& derived, const SharedModel& model, const Shared& unknowns) {
  constexpr double kStep = 1e-3;
  Shared result;
  for (int i = 0; i < kSharedNumbers; ++i) {
    Shared more = unknowns;
    Shared less = unknowns;
    more[i] += kStep;
    less[i] -= kStep;
    result[i] = (derived.value(model.numbers(more)) - derived.value(model.numbers(less))) / (2 * kStep);
  }
  return result;
}

}  // namespace

std::vector<int> unobserved(const Eigen::MatrixXd& information, const SharedModel& model) {
  std::vector<int> held;
  for (int i = 0; i < kSharedNumbers; ++i) {
    if (model.sigma[i] == 0) held.push_back(i);
  }
  for (;;) {
    const std::vector<int> free = all_but(held, information.rows());
    const auto shared = std::ranges::count_if(free, [](int i) { return i < kSharedNumbers; });
    if (shared == 0) return held;
    const Eigen::MatrixXd block = information(free, free);
    const Eigen::MatrixXd covariance = block.ldlt().solve(Eigen::MatrixXd::Identity(block.rows(), block.cols()));
    Eigen::Index worst = 0;
    const double greatest = covariance.diagonal().head(shared).maxCoeff(&worst);
    if (std::sqrt(greatest) <= kObservedShare) return held;
    held.push_back(free[std::size_t(worst)]);
  }
}

Eigen::MatrixXd consider_covariance(const Eigen::MatrixXd& information, const std::vector<int>& held) {
  const std::vector<int> free = all_but(held, information.rows());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(information.rows(), information.rows());
  for (const int i : held) covariance(i, i) = 1;
  if (free.empty()) return covariance;
  const Eigen::MatrixXd block = information(free, free);
  const auto factor = block.ldlt();
  const Eigen::MatrixXd own = factor.solve(Eigen::MatrixXd::Identity(block.rows(), block.cols()));
  // The derivative of the answer by the held numbers. The errors of held priors are independent of the others.
  const Eigen::MatrixXd pull = -factor.solve(Eigen::MatrixXd(information(free, held)));
  covariance(free, free) = own + pull * pull.transpose();
  covariance(free, held) = pull;
  covariance(held, free) = pull.transpose();
  return covariance;
}

ParameterList parameter_list(const SharedModel& model, const Shared& unknowns, const Eigen::MatrixXd& covariance,
                             const std::vector<int>& held) {
  ParameterList list;
  std::vector<Shared> slopes;  // gradient of each parameter by the unknowns
  const Shared after = model.numbers(unknowns);
  for (int i = 0; i < kSharedNumbers; ++i) {
    if (model.sigma[i] == 0) continue;
    CalibratedParameter& p = list.parameters.emplace_back();
    p.name = name_of(i);
    p.before = model.mean[i];
    p.observed = std::find(held.begin(), held.end(), i) == held.end();
    p.after = p.observed ? after[i] : p.before;
    slopes.emplace_back(model.sigma[i] * Shared::Unit(i));
  }
  const std::size_t own = list.parameters.size();
  for (const Derived& derived : derived_numbers(model.has_wheels)) {
    Shared slope = gradient(derived, model, unknowns);
    for (int i = 0; i < kSharedNumbers; ++i) {
      if (model.sigma[i] == 0) slope[i] = 0;
    }
    CalibratedParameter& p = list.parameters.emplace_back();
    p.name = derived.name;
    p.derived = true;
    p.before = derived.value(model.mean);
    p.after = derived.value(after);
    slopes.push_back(slope);
  }
  Eigen::MatrixXd by_unknowns(Eigen::Index(slopes.size()), Eigen::Index(kSharedNumbers));
  for (std::size_t i = 0; i < slopes.size(); ++i) by_unknowns.row(Eigen::Index(i)) = slopes[i].transpose();
  list.covariance = by_unknowns * covariance.topLeftCorner(kSharedNumbers, kSharedNumbers) * by_unknowns.transpose();
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    CalibratedParameter& p = list.parameters[i];
    p.sigma = std::sqrt(list.covariance(Eigen::Index(i), Eigen::Index(i)));
    p.prior_sigma = slopes[i].norm();
    if (i >= own) p.observed = p.sigma <= kObservedShare * p.prior_sigma;
  }
  return list;
}

}  // namespace twocone::vision::calibration
