// SPDX-License-Identifier: Apache-2.0
#include "vision/calibration/landmark_shifts.h"

#include <algorithm>

#include <Eigen/Cholesky>

namespace twocone::vision {
namespace {

/// The matrix that maps all shifts to the shift of `tested` relative to `others`.
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

namespace calibration {

std::vector<std::size_t> seen_landmarks(const BundleData& data) {
  std::vector<std::size_t> seen;
  for (const SightingRow& row : data.sightings) {
    if (row.used) seen.push_back(row.landmark_index);
  }
  std::ranges::sort(seen);
  // Clang 14 does not compile libstdc++'s std::ranges::unique.
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  return seen;
}

void take_landmark_shifts(const BundleData& data, const BundleState& state, const Eigen::MatrixXd& covariance,
                          const std::vector<std::size_t>& seen, CalibrationResult& result) {
  const double sigma_m = data.model.landmark_sigma_m;
  std::vector<Eigen::Index> columns;
  for (const std::size_t i : seen) {
    for (const int axis : {0, 1}) columns.push_back(kSharedNumbers + 2 * Eigen::Index(i) + axis);
  }
  result.landmark_covariance = sigma_m * sigma_m * covariance(columns, columns);
  for (const std::size_t i : seen) {
    const Eigen::Index at = 2 * Eigen::Index(result.landmark_shifts.size());
    result.landmark_shifts.push_back({i, sigma_m * state.landmarks[i], result.landmark_covariance.block<2, 2>(at, at)});
  }
}

}  // namespace calibration

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
    const Eigen::MatrixXd remainder = remainder_of(i, others, places_m);
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
