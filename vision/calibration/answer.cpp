// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/bundle.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include <Eigen/Cholesky>

#include "vision/calibration/bundle_rows.h"

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

/// Computes the gradient by the unknowns. The functions are smooth over a prior's sigma, so central differences over a
/// thousandth of it have a relative error of some 1e-6.
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

/// Returns the column of a landmark's first number among the unknowns.
Eigen::Index landmark_column(std::size_t landmark) {
  return kSharedNumbers + kLandmarkNumbers * Eigen::Index(landmark);
}

/// Returns the matrix that maps all shifts to the shift of `tested` relative to `others`.
/// @param tested,others indices into the result's landmark_shifts
Eigen::MatrixXd remainder_of(std::size_t tested, const std::vector<std::size_t>& others,
                             const std::vector<Eigen::Vector2d>& places_m) {
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();
  for (const std::size_t i : others) middle_m += places_m[i] / double(others.size());
  // Columns: the motion of landmark i by a common scale, and by a common rotation.
  const auto motions = [&](std::size_t i) {
    const Eigen::Vector2d arm = places_m[i] - middle_m;
    Eigen::Matrix2d both;
    both << arm.x(), -arm.y(), arm.y(), arm.x();
    return both;
  };
  double spread_m2 = 0;
  for (const std::size_t i : others) spread_m2 += (places_m[i] - middle_m).squaredNorm();
  Eigen::MatrixXd remainder = Eigen::MatrixXd::Zero(2, 2 * Eigen::Index(places_m.size()));
  remainder.middleCols<2>(2 * Eigen::Index(tested)).setIdentity();
  for (const std::size_t i : others) {
    auto part = remainder.middleCols<2>(2 * Eigen::Index(i));
    part -= Eigen::Matrix2d::Identity() / double(others.size());
    // Landmarks at one place determine neither.
    if (spread_m2 > 0) part -= motions(tested) * motions(i).transpose() / spread_m2;
  }
  return remainder;
}

}  // namespace

std::vector<int> unobserved(const Eigen::MatrixXd& information, const SharedModel& model) {
  std::vector<int> held = model.fixed;
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

Eigen::MatrixXd consider_covariance(const Eigen::MatrixXd& information, const std::vector<int>& held,
                                    const Eigen::MatrixXd& held_covariance) {
  const std::vector<int> free = all_but(held, information.rows());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(information.rows(), information.rows());
  const Eigen::MatrixXd believed = held_covariance(held, held);
  covariance(held, held) = believed;
  if (free.empty()) return covariance;
  const Eigen::MatrixXd block = information(free, free);
  const auto factor = block.ldlt();
  const Eigen::MatrixXd own = factor.solve(Eigen::MatrixXd::Identity(block.rows(), block.cols()));
  // The derivative of the answer by the held numbers.
  const Eigen::MatrixXd pull = -factor.solve(Eigen::MatrixXd(information(free, held)));
  covariance(free, held) = pull * believed;
  covariance(held, free) = (pull * believed).transpose();
  covariance(free, free) = own + pull * believed * pull.transpose();
  return covariance;
}

void take_parameters(const SharedModel& model, const Shared& unknowns, const Eigen::MatrixXd& covariance,
                     const std::vector<int>& held, CalibrationResult& result) {
  std::vector<Shared> slopes;  // gradient of each parameter by the unknowns
  const Shared after = model.numbers(unknowns);
  for (int i = 0; i < kSharedNumbers; ++i) {
    if (model.sigma[i] == 0) continue;
    CalibratedParameter& p = result.parameters.emplace_back();
    p.name = name_of(i);
    p.before = model.mean[i];
    p.observed = std::find(held.begin(), held.end(), i) == held.end();
    p.after = p.observed ? after[i] : p.before;
    slopes.emplace_back(model.sigma[i] * Shared::Unit(i));
  }
  const std::size_t own = result.parameters.size();
  for (const Derived& derived : derived_numbers(model.has_wheels)) {
    Shared slope = gradient(derived, model, unknowns);
    for (int i = 0; i < kSharedNumbers; ++i) {
      if (model.sigma[i] == 0) slope[i] = 0;
    }
    CalibratedParameter& p = result.parameters.emplace_back();
    p.name = derived.name;
    p.derived = true;
    p.before = derived.value(model.mean);
    p.after = derived.value(after);
    slopes.push_back(slope);
  }
  Eigen::MatrixXd by_unknowns(Eigen::Index(slopes.size()), Eigen::Index(kSharedNumbers));
  for (std::size_t i = 0; i < slopes.size(); ++i) by_unknowns.row(Eigen::Index(i)) = slopes[i].transpose();
  result.covariance = by_unknowns * covariance.topLeftCorner(kSharedNumbers, kSharedNumbers) * by_unknowns.transpose();
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    CalibratedParameter& p = result.parameters[i];
    p.sigma = std::sqrt(result.covariance(Eigen::Index(i), Eigen::Index(i)));
    p.prior_sigma = slopes[i].norm();
    if (i >= own) p.observed = p.sigma <= kObservedShare * p.prior_sigma;
  }
}

std::vector<std::size_t> seen_landmarks(const BundleData& data) {
  std::set<std::size_t> seen;
  for (const SightingRow& row : data.sightings) {
    if (row.used) seen.insert(row.landmark_index);
  }
  return {seen.begin(), seen.end()};
}

void take_landmark_shifts(const std::vector<Landmark>& landmarks, const BundleState& state,
                          const Eigen::MatrixXd& covariance, const std::vector<std::size_t>& seen,
                          CalibrationResult& result) {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd sigmas(2 * Eigen::Index(seen.size()));
  for (const std::size_t i : seen) {
    sigmas.segment<2>(Eigen::Index(columns.size())) = sigmas_of(landmarks[i]).head<2>();
    for (const int axis : {kPlaceX, kPlaceY}) columns.push_back(landmark_column(i) + axis);
  }
  result.landmark_covariance = sigmas.asDiagonal() * covariance(columns, columns) * sigmas.asDiagonal();
  for (const std::size_t i : seen) {
    const Eigen::Index at = 2 * Eigen::Index(result.landmark_shifts.size());
    const LandmarkVector shift = sigmas_of(landmarks[i]).cwiseProduct(state.landmarks[i]);
    result.landmark_shifts.push_back({i, shift.head<2>(), result.landmark_covariance.block<2, 2>(at, at)});
  }
}

void take_belief(const SharedModel& model, const std::vector<Landmark>& landmarks, const BundleState& state,
                 const Eigen::MatrixXd& covariance, CalibrationResult& result) {
  const auto count = Eigen::Index(landmarks.size());
  const Eigen::Index places = kRigNumbers;
  const Eigen::Index wheels = places + kLandmarkNumbers * count;
  // The believed numbers by the unknowns.
  const Eigen::Index times = wheels + CalibrationResult::kWheelNumbers;
  Eigen::MatrixXd by_unknowns = Eigen::MatrixXd::Zero(times + kTimeNumbers, covariance.cols());
  for (int i = 0; i < kRigNumbers; ++i) by_unknowns(i, i) = model.sigma[i];
  for (const int number : {kAzimuth, kOffsetX, kOffsetY}) {
    const int lower = rig_number(Side::kLower, number);
    by_unknowns(rig_number(Side::kUpper, number), lower) = model.sigma[lower];
  }
  for (const int i : {kWheelRadius, kWheelRatio, kWheelSeparation}) {
    by_unknowns(wheels + (i - kWheelRadius), i) = model.sigma[i];
  }
  // As in to_exposures().
  by_unknowns(times + kLateOfLower, kLatency) = by_unknowns(times + kLateOfUpper, kLatency) = -model.sigma[kLatency];
  by_unknowns(times + kLateOfUpper, kSkew) = model.sigma[kSkew];
  by_unknowns(times + kReadoutOfLower, kLowerReadout) = model.sigma[kLowerReadout];
  by_unknowns(times + kReadoutOfUpper, kUpperReadout) = model.sigma[kUpperReadout];
  result.landmarks = landmarks;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const LandmarkVector sigma = sigmas_of(landmarks[i]);
    if (covariance.cols() > kSharedNumbers) {
      by_unknowns.block<kLandmarkNumbers, kLandmarkNumbers>(places + kLandmarkNumbers * Eigen::Index(i),
                                                            landmark_column(i)) = sigma.asDiagonal();
    }
    const LandmarkVector shift = sigma.cwiseProduct(state.landmarks[i]);
    Landmark& refined = result.landmarks[i];
    refined.x_m += shift[kPlaceX];
    refined.y_m += shift[kPlaceY];
    refined.top_m += shift[kTop];
    refined.radius_m += shift[kRadius];
  }
  result.belief_covariance = by_unknowns * covariance * by_unknowns.transpose();
}

}  // namespace twocone::vision::calibration

namespace twocone::vision {

std::vector<RelativeShift> shifts_among(const CalibrationResult& result, const std::vector<Landmark>& landmarks,
                                        double chi_squared_limit) {
  const std::size_t count = result.landmark_shifts.size();
  if (count < 3) return {};
  Eigen::VectorXd shifts_m(2 * Eigen::Index(count));
  std::vector<Eigen::Vector2d> places_m;
  std::vector<std::size_t> standing;
  for (std::size_t i = 0; i < count; ++i) {
    shifts_m.segment<2>(2 * Eigen::Index(i)) = result.landmark_shifts[i].shift_m;
    places_m.push_back(place_m(landmarks.at(result.landmark_shifts[i].landmark)));
    standing.push_back(i);
  }
  const auto tested = [&](std::size_t i) {
    std::vector<std::size_t> others = standing;
    std::erase(others, i);
    const Eigen::MatrixXd remainder = calibration::remainder_of(i, others, places_m);
    RelativeShift relative;
    relative.shift = {result.landmark_shifts[i].landmark, remainder * shifts_m,
                      remainder * result.landmark_covariance * remainder.transpose()};
    relative.chi_squared = relative.shift.shift_m.dot(relative.shift.covariance.ldlt().solve(relative.shift.shift_m));
    relative.moved = relative.chi_squared > chi_squared_limit;
    return relative;
  };
  while (standing.size() >= 4) {
    const auto chi_squared = [&](std::size_t i) { return tested(i).chi_squared; };
    const auto worst = std::ranges::max_element(standing, {}, chi_squared);
    if (!tested(*worst).moved) break;
    standing.erase(worst);
  }
  std::vector<RelativeShift> answer;
  for (std::size_t i = 0; i < count; ++i) answer.push_back(tested(i));
  return answer;
}

}  // namespace twocone::vision
