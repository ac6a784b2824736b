// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares_fix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <boost/container/small_vector.hpp>

#include "base/errors.h"
#include "base/quantile.h"
#include "localisation/chi_squared.h"
#include "localisation/least_squares/answer.h"
#include "localisation/least_squares/problem.h"

namespace twocone::localisation {
namespace {

using least_squares::Answer;
using least_squares::Frame;
using least_squares::Landmark;
using least_squares::Place;
using least_squares::Problem;
using least_squares::SharedErrors;

/// Fewer degrees of freedom give too little information on the scatter.
constexpr int kLeastWidening = 3;
/// Chi-squared counts as usual if its tail probability is above this.
constexpr double kUsual = 0.05;

Eigen::Vector2d to_world(const Frame& frame, const Place& place) {
  return frame.origin_m + Eigen::Vector2d(place.state.x, place.state.y) * frame.unit_m;
}

Eigen::Matrix3d to_world_covariance(const Frame& frame, const Place& place) {
  const Eigen::Vector3d unit(frame.unit_m, frame.unit_m, 1);
  return unit.asDiagonal() * place.covariance * unit.asDiagonal();
}

/// Splits the covariance of a place into its sources.
void split(const Problem& problem, const Frame& frame, const Place& place, std::optional<Eigen::Matrix3d>& own,
           BySharedErrors<3>& by_shared) {
  const Eigen::Matrix3d& c = place.covariance;
  const least_squares::Estimate estimate =
      least_squares::estimate_at(problem, place.state, std::sqrt(c(0, 0) + c(1, 1)));
  const Eigen::Vector3d unit(frame.unit_m, frame.unit_m, 1);
  own = unit.asDiagonal() * estimate.own_covariance * unit.asDiagonal();
  by_shared = unit.asDiagonal() * estimate.by_shared;
}

void fill(Fix& fix, const Problem& problem, const Answer& answer, const Frame& frame) {
  fix.verdict = answer.verdict;
  fix.chi_squared = answer.chi_squared;
  fix.degrees_of_freedom = answer.degrees_of_freedom;
  if (answer.verdict == FixVerdict::kTooFew || answer.verdict == FixVerdict::kContradictory) return;
  const Eigen::Vector2d position_m = to_world(frame, answer.place);
  const Eigen::Matrix3d covariance = to_world_covariance(frame, answer.place);
  if (!position_m.allFinite() || !covariance.allFinite()) {
    fix.verdict = FixVerdict::kTooFew;  // too large for a double
    return;
  }
  fix.used = int(problem.landmarks.size());
  fix.position_m = position_m;
  fix.covariance = covariance;
  if (problem.has_heading) fix.heading_rad = answer.place.state.heading_rad;
  if (answer.other) {
    fix.other_position_m = to_world(frame, *answer.other);
    fix.other_covariance = to_world_covariance(frame, *answer.other);
    if (problem.has_heading) fix.other_heading_rad = answer.other->state.heading_rad;
  }
  if (!answer.unseen && problem.shared != nullptr) {
    split(problem, frame, answer.place, fix.own_covariance, fix.by_shared);
    if (answer.other) split(problem, frame, *answer.other, fix.other_own_covariance, fix.other_by_shared);
  } else if (!answer.unseen) {
    fix.own_covariance = fix.covariance;
    fix.other_own_covariance = fix.other_covariance;
  }
  if (answer.unseen) {
    Eigen::Vector3d direction = *answer.unseen;
    // Metres and radians are mixed; use the factor that does not overflow.
    if (frame.unit_m > 1) {
      direction.z() /= frame.unit_m;
    } else {
      direction.head<2>() *= frame.unit_m;
    }
    fix.unseen_direction = direction.normalized();
  }
}

/// Multiplies the covariance by chi-squared over its degrees of freedom (Birge's ratio) where the residuals are larger
/// than the stated sigmas explain: sigmas that are too small are a more likely reason than chance.
void widen(Fix& fix) {
  if (fix.degrees_of_freedom < kLeastWidening || !fix.covariance) return;
  if (chi_squared_tail(fix.chi_squared, fix.degrees_of_freedom) > kUsual) return;
  fix.widening = fix.chi_squared / fix.degrees_of_freedom;
  // The shared errors keep their sizes, so that they are the same in all frames: what is added counts as own noise.
  const auto widen_one = [&](std::optional<Eigen::Matrix3d>& covariance, std::optional<Eigen::Matrix3d>& own) {
    if (!covariance) return;
    if (own) *own += (fix.widening - 1) * *covariance;
    *covariance *= fix.widening;
  };
  widen_one(fix.covariance, fix.own_covariance);
  widen_one(fix.other_covariance, fix.other_own_covariance);
}

/// Returns whether the fit of all measurements can be used with a widened covariance, because each is only a little
/// worse than its sigma.
bool is_mild(const Answer& all) {
  return all.verdict == FixVerdict::kOk && all.degrees_of_freedom >= kLeastWidening &&
         all.chi_squared <= least_squares::kMostRatio * all.degrees_of_freedom;
}

/// Up to this ratio to the largest length, a length loses no more than half of its digits.
constexpr double kFar = 1e8;

/// Returns the indices of the measurements whose landmark or range is farther out than the median by so much that the
/// others would lose their digits.
std::vector<int> find_far(std::span<const LandmarkMeasurement> measurements) {
  std::vector<double> x;
  std::vector<double> y;
  for (const LandmarkMeasurement& m : measurements) {
    if (!m.landmark_m.allFinite()) continue;
    x.push_back(m.landmark_m.x());
    y.push_back(m.landmark_m.y());
  }
  if (x.size() < least_squares::kFewestBelieved + 1) return {};
  const Eigen::Vector2d middle_m(base::median(std::move(x)), base::median(std::move(y)));
  std::vector<double> sizes_m;
  for (const LandmarkMeasurement& m : measurements) {
    // Halve first: the sum of two huge numbers overflows.
    const Eigen::Vector2d half_m = m.landmark_m / 2 - middle_m / 2;
    sizes_m.push_back(std::max(half_m.cwiseAbs().maxCoeff(), m.range_m.value_or(0) / 2));
  }
  std::vector<double> sorted_m;
  for (const double size_m : sizes_m) {
    if (std::isfinite(size_m)) sorted_m.push_back(size_m);
  }
  if (sorted_m.empty()) return {};
  const double usual_m = base::median(std::move(sorted_m));
  std::vector<int> far;
  for (std::size_t i = 0; i < sizes_m.size(); ++i) {
    if (usual_m > 0 && std::isfinite(sizes_m[i]) && sizes_m[i] / kFar > usual_m) far.push_back(int(i));
  }
  return far;
}

Fix fix_of(std::span<const LandmarkMeasurement> measurements) {
  Fix fix;
  Frame frame;
  boost::container::small_vector<Landmark, least_squares::kStackLandmarks> room(measurements.size());
  const int count = least_squares::prepare(measurements, frame, room.data());
  fix.unusable = int(measurements.size()) - count;
  const std::span<const Landmark> landmarks{room.data(), std::size_t(count)};
  SharedErrors shared{measurements, frame};
  Problem problem = least_squares::make_problem(landmarks, frame.rounding);
  if (shared.any()) {
    // The effect of a landmark's place depends on the direction in which it is seen, so a first answer finds the state.
    const Answer first = least_squares::solve(problem);
    if (first.verdict == FixVerdict::kOk) shared.seen_from = first.place.state;
    problem = least_squares::make_problem(landmarks, frame.rounding, &shared);
  }
  const Answer answer = least_squares::solve(problem);
  if (answer.is_consistent || answer.verdict == FixVerdict::kTooFew) {
    fill(fix, problem, answer, frame);
  } else {
    fix.chi_squared = answer.chi_squared;
    fix.degrees_of_freedom = answer.degrees_of_freedom;
    if (const auto cleaned = least_squares::without_outliers(problem)) {
      std::vector<Landmark> kept;
      for (int i = 0; i < count; ++i) {
        if (std::binary_search(cleaned->left_out.begin(), cleaned->left_out.end(), i)) {
          fix.outliers.push_back(room[i].index);
        } else {
          kept.push_back(room[i]);
        }
      }
      std::sort(fix.outliers.begin(), fix.outliers.end());
      fill(fix, least_squares::make_problem(kept, frame.rounding, problem.shared), cleaned->answer, frame);
    } else if (is_mild(answer)) {
      fill(fix, problem, answer, frame);
    } else {
      fix.verdict = FixVerdict::kContradictory;
    }
  }
  widen(fix);
  if (fix.verdict == FixVerdict::kWeak) {
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      if (!std::binary_search(fix.outliers.begin(), fix.outliers.end(), int(i))) {
        fix.measurements.push_back(measurements[i]);
      }
    }
  }
  return fix;
}

/// Returns whether a measurement agrees with a fix of the others, up to the rounding of doubles of its size.
bool is_expected(const LandmarkMeasurement& m, const Fix& fix) {
  constexpr double kSigmas2 = 25;
  const Eigen::Vector2d to_m = m.landmark_m - *fix.position_m;
  const double distance_m = std::hypot(to_m.x(), to_m.y());
  const double spread_m2 = fix.covariance->topLeftCorner<2, 2>().trace();
  const double rounding_m = 4 * least_squares::kEps * (distance_m + m.landmark_m.cwiseAbs().maxCoeff());
  if (!std::isfinite(distance_m)) return false;
  if (m.range_m) {
    const double off = (*m.range_m - distance_m) / std::hypot(std::sqrt(m.covariance(0, 0) + spread_m2), rounding_m);
    if (!(off * off <= kSigmas2)) return false;
  }
  if (m.bearing_rad && fix.heading_rad) {
    const double off = wrap_angle_rad(std::atan2(to_m.y(), to_m.x()) - *fix.heading_rad - *m.bearing_rad);
    if (!(off * off <=
          kSigmas2 * (m.covariance(1, 1) + (*fix.covariance)(2, 2) + spread_m2 / distance_m / distance_m))) {
      return false;
    }
  }
  return true;
}

/// Computes the fix without measurements that are far out by orders of magnitude. Returns nothing unless the others
/// give a fix that contradicts these.
std::optional<Fix> fix_without_far(std::span<const LandmarkMeasurement> measurements) {
  const std::vector<int> far = find_far(measurements);
  if (far.empty() || 2 * far.size() >= measurements.size()) return std::nullopt;
  std::vector<LandmarkMeasurement> near;
  std::vector<int> index;
  for (int i = 0; i < int(measurements.size()); ++i) {
    if (std::binary_search(far.begin(), far.end(), i)) continue;
    near.push_back(measurements[std::size_t(i)]);
    index.push_back(i);
  }
  Fix fix = fix_of(near);
  // The fix must be confirmed by further landmarks, and use more of them than are left out.
  if (fix.verdict != FixVerdict::kOk || fix.degrees_of_freedom < 1 || fix.used < least_squares::kFewestBelieved ||
      fix.used <= int(far.size() + fix.outliers.size())) {
    return std::nullopt;
  }
  for (int& outlier : fix.outliers) outlier = index[std::size_t(outlier)];
  for (const int i : far) {
    if (is_expected(measurements[std::size_t(i)], fix)) return std::nullopt;
    fix.outliers.push_back(i);
  }
  std::sort(fix.outliers.begin(), fix.outliers.end());
  return fix;
}

/// Returns whether a length is so much larger than another that find_far() may find a measurement; it needs no heap.
bool may_have_far(std::span<const LandmarkMeasurement> measurements) {
  double longest_m = 0;
  double shortest_m = std::numeric_limits<double>::infinity();
  for (const LandmarkMeasurement& m : measurements) {
    const Eigen::Vector2d half_m = m.landmark_m / 2 - measurements.front().landmark_m / 2;
    for (const double length_m : {half_m.cwiseAbs().maxCoeff(), m.range_m.value_or(0) / 2}) {
      if (!(length_m > 0) || !std::isfinite(length_m)) continue;
      longest_m = std::max(longest_m, length_m);
      shortest_m = std::min(shortest_m, length_m);
    }
  }
  return longest_m / kFar > shortest_m;
}

}  // namespace

Fix fix_by_least_squares(std::span<const LandmarkMeasurement> measurements) {
  if (may_have_far(measurements)) {
    if (const auto fix = fix_without_far(measurements)) return *fix;
  }
  return fix_of(measurements);
}

std::optional<Eigen::Matrix3d> pose_bound(const Pose& pose, std::span<const Eigen::Vector2d> landmarks_m,
                                          std::span<const Eigen::Matrix2d> information) {
  if (landmarks_m.size() != information.size()) {
    throw base::InvalidArgument("pose_bound: {} landmarks, but information of {}", landmarks_m.size(),
                                information.size());
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < landmarks_m.size(); ++i) {
    const double dx_m = landmarks_m[i].x() - pose.x_m;
    const double dy_m = landmarks_m[i].y() - pose.y_m;
    const double range_m = std::hypot(dx_m, dy_m);
    if (range_m == 0) continue;  // it has no gradient
    const double ux = dx_m / range_m;
    const double uy = dy_m / range_m;
    Eigen::Matrix<double, 2, 3> j;
    j << -ux, -uy, 0, uy / range_m, -ux / range_m, -1;
    sum += j.transpose() * information[i] * j;
  }
  if (!sum.allFinite() || !(sum.diagonal().minCoeff() > 0)) return std::nullopt;
  // Scale to unit diagonal first, since metres and radians are mixed.
  const Eigen::Vector3d scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix3d scaled = scale.asDiagonal() * sum * scale.asDiagonal();
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(scaled);
  // Each of the sum's terms was rounded by a few units.
  const double rounding = 16 * std::numeric_limits<double>::epsilon() * double(landmarks_m.size() + 3);
  if (!(ldlt.vectorD().minCoeff() > rounding)) return std::nullopt;
  const Eigen::Matrix3d inverse = ldlt.solve(Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d symmetric = (inverse + inverse.transpose()) / 2;
  const Eigen::Matrix3d bound = scale.asDiagonal() * symmetric * scale.asDiagonal();
  if (!bound.allFinite()) return std::nullopt;  // too large for a double
  return bound;
}

std::optional<Eigen::Matrix3d> shared_pose_bound(const Pose& pose, std::span<const InformedMeasurement> measurements) {
  Eigen::Index count = 0;
  for (const InformedMeasurement& m : measurements) {
    count = std::max({count, m.by_shared.cols(), m.place_by_shared.cols()});
  }
  // The unknowns are the pose, then the shared errors with their prior.
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(3 + count, 3 + count);
  information.bottomRightCorner(count, count).setIdentity();
  std::vector<Eigen::Vector2d> landmarks_m;
  std::vector<Eigen::Matrix2d> own;
  for (const InformedMeasurement& m : measurements) {
    landmarks_m.push_back(m.landmark_m);
    own.push_back(m.information);
    const Eigen::Vector2d to_m = m.landmark_m - Eigen::Vector2d(pose.x_m, pose.y_m);
    const double range_m = to_m.norm();
    if (range_m == 0) continue;  // it has no gradient
    const Eigen::RowVector2d u = to_m.transpose() / range_m;
    const Eigen::RowVector2d sideways(-u.y() / range_m, u.x() / range_m);
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(2, 3 + count);
    j.leftCols<3>() << -u, 0, -sideways, -1;
    if (m.by_shared.cols() > 0) j.rightCols(count) += m.by_shared;
    if (m.place_by_shared.cols() > 0) {
      j.row(0).tail(count) += u * m.place_by_shared;
      j.row(1).tail(count) += sideways * m.place_by_shared;
    }
    information += j.transpose() * m.information * j;
  }
  if (!pose_bound(pose, landmarks_m, own)) return std::nullopt;
  const Eigen::MatrixXd inverse =
      information.ldlt().solve(Eigen::MatrixXd::Identity(3 + count, 3 + count).leftCols<3>());
  const Eigen::Matrix3d bound = inverse.topRows<3>();
  if (!bound.allFinite() || !(bound.diagonal().minCoeff() > 0)) return std::nullopt;
  return Eigen::Matrix3d((bound + bound.transpose()) / 2);
}

}  // namespace twocone::localisation
