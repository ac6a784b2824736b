// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/estimator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>

#include <Eigen/LU>

#include "localisation/least_squares_fix.h"

namespace twocone::estimation {
namespace {

using localisation::Fix;
using localisation::FixVerdict;
using vision::RangeMeasurement;
using vision::RangeVerdict;

// Ratio of the sigmas of a refined and a found landmark, 0.03 px to 0.4 px. It affects only the order of refinement.
constexpr double kFineOverFound = 1.0 / 12;
// With fewer refined landmarks, hardly anything contradicts a wrong one. Three ranges overdetermine the position, so
// with two refined landmarks a found one checks it.
constexpr int kLeastRefined = 2;

/// One landmark in one view, and the share of the landmark's information that this view gives.
struct Unit {
  std::size_t landmark;
  vision::Views view;
  double share;
};
/// Returns the units of all landmarks whose top the finder saw. The information on range and bearing grows with the
/// squared distance of the top from the image's centre.
std::vector<Unit> units_of(const std::vector<RangeMeasurement>& found,
                           const std::array<Eigen::Vector2d, 2>& centres_px) {
  std::vector<Unit> units;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const RangeMeasurement& m = found[k];
    const double lower = m.lower_sighting ? (m.lower_sighting->pixel_px - centres_px[0]).squaredNorm() : 0;
    const double upper = m.upper_sighting ? (m.upper_sighting->pixel_px - centres_px[1]).squaredNorm() : 0;
    if (lower > 0) units.push_back({k, vision::Views::kLower, lower / (lower + upper)});
    if (upper > 0) units.push_back({k, vision::Views::kUpper, upper / (lower + upper)});
  }
  return units;
}

/// Returns whether the finder measured the landmark but a view gave no outline to fit, which suggests a thin landmark.
bool stays_found(const RangeMeasurement& fine, const RangeMeasurement& found) {
  if (fine.range_m || fine.bearing_rad || !found.range_m) return false;
  return fine.verdict == RangeVerdict::kNoMatch || (fine.verdict == RangeVerdict::kOccluded &&
                                                    fine.lower_sighting.has_value() != fine.upper_sighting.has_value());
}

double position_sigma_m(const Fix& fix) {
  if (!fix.covariance) return std::numeric_limits<double>::infinity();
  return std::sqrt((*fix.covariance)(0, 0) + (*fix.covariance)(1, 1));
}

/// The information matrix of (x, y, heading), summed over the landmarks and linearised at one pose.
class Information {
 public:
  Information(const Eigen::Vector2d& position_m, bool use_bearings, std::size_t landmarks)
      : position_m_(position_m), use_bearings_(use_bearings), each_(landmarks, Eigen::Matrix3d::Zero()) {}

  void set(std::size_t k, const RangeMeasurement& m, const Eigen::Vector2d& landmark_m) {
    sum_ -= each_[k];
    each_[k] = of(m, landmark_m);
    sum_ += each_[k];
  }
  /// Stores the present information as that of the found stage.
  void keep_found() { found_ = each_; }
  [[nodiscard]] double position_variance_m2() const { return variance(sum_); }
  /// Returns the variance if a fine fit replaced this share of the information of the found landmark `k`.
  [[nodiscard]] double with_refined_m2(std::size_t k, double share) const {
    constexpr double kMore = 1 / (kFineOverFound * kFineOverFound) - 1;
    return variance(sum_ + share * kMore * found_[k]);
  }

 private:
  [[nodiscard]] Eigen::Matrix3d of(const RangeMeasurement& m, const Eigen::Vector2d& landmark_m) const {
    if (!m.covariance || !m.range_m) return Eigen::Matrix3d::Zero();
    const Eigen::Vector2d to_m = landmark_m - position_m_;
    const double range_m = to_m.norm();
    if (!(range_m > 0)) return Eigen::Matrix3d::Zero();
    const Eigen::Vector2d u = to_m / range_m;
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    if (use_bearings_ && m.bearing_rad) {
      information = m.covariance->inverse();
    } else {
      information(0, 0) = 1 / (*m.covariance)(0, 0);
    }
    Eigen::Matrix<double, 2, 3> j;
    j << -u.x(), -u.y(), 0, u.y() / range_m, -u.x() / range_m, -1;
    return j.transpose() * information * j;
  }
  /// Returns the variance of the position after the heading is eliminated.
  static double variance(const Eigen::Matrix3d& sum) {
    Eigen::Matrix2d position = sum.topLeftCorner<2, 2>();
    if (sum(2, 2) > 0) position -= sum.topRightCorner<2, 1>() * sum.bottomLeftCorner<1, 2>() / sum(2, 2);
    const double determinant = position.determinant();
    return determinant > 0 ? position.trace() / determinant : std::numeric_limits<double>::infinity();
  }

  Eigen::Vector2d position_m_;
  bool use_bearings_;
  std::vector<Eigen::Matrix3d> each_;
  std::vector<Eigen::Matrix3d> found_;
  Eigen::Matrix3d sum_ = Eigen::Matrix3d::Zero();
};

}  // namespace

double thread_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

Fix fix_of_outline(const std::vector<RangeMeasurement>& measured, const std::vector<Eigen::Vector2d>& landmarks_m,
                   bool use_bearings, const std::vector<BySharedErrors<2>>& places_by_shared) {
  std::vector<localisation::LandmarkMeasurement> measurements;
  std::vector<int> landmarks;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const RangeMeasurement& m = measured[i];
    const auto bearing_rad = use_bearings ? m.bearing_rad : std::nullopt;
    if (!m.covariance || (!m.range_m && !bearing_rad)) continue;
    measurements.push_back({landmarks_m[i], m.range_m, bearing_rad, m.own_covariance.value_or(*m.covariance),
                            m.by_shared, places_by_shared.empty() ? BySharedErrors<2>() : places_by_shared[i]});
    landmarks.push_back(int(i));
  }
  Fix fix = localisation::fix_by_least_squares(measurements);
  for (int& outlier : fix.outliers) outlier = landmarks.at(std::size_t(outlier));
  return fix;
}

FrameAnswer refine_adaptively(vision::FrameObservation& observation, const std::vector<Eigen::Vector2d>& landmarks_m,
                              const std::vector<BySharedErrors<2>>& places_by_shared,
                              const std::array<Eigen::Vector2d, 2>& centres_px, const config::EstimatorKeys& keys,
                              const std::function<double()>& clock_s, double begin_s) {
  FrameAnswer answer;
  const std::vector<RangeMeasurement> found = observation.measurements();
  const double looked_s = keys.budget_s ? clock_s() : 0;
  const auto locate = [&](bool use_bearings) {
    const double from_s = thread_time_s();
    Fix fix = fix_of_outline(answer.ranges, landmarks_m, use_bearings, places_by_shared);
    answer.timing.localisation_s += thread_time_s() - from_s;
    return fix;
  };
  answer.ranges = found;
  answer.fix = locate(keys.bearings);
  const double located_s = keys.budget_s ? clock_s() : 0;
  const auto is_enough = [&] {
    const Fix& fix = answer.fix;
    return fix.verdict == FixVerdict::kOk && fix.outliers.empty() && position_sigma_m(fix) <= keys.enough_m;
  };
  if (is_enough()) return answer;

  // The prediction of the landmarks' places uses bearings even if the answer must not use them.
  const Fix guide = keys.bearings ? answer.fix : locate(true);
  std::vector<Unit> left = units_of(found, centres_px);
  const bool is_guided = guide.verdict == FixVerdict::kOk && guide.heading_rad;
  if (is_guided) {
    for (std::size_t k = 0; k < found.size(); ++k) {
      const Eigen::Vector2d to_m = landmarks_m[k] - *guide.position_m;
      if (std::find(guide.outliers.begin(), guide.outliers.end(), int(k)) != guide.outliers.end()) continue;
      observation.expect(k, to_m.norm(), std::atan2(to_m.y(), to_m.x()) - *guide.heading_rad);
    }
  }
  Information information(guide.position_m.value_or(Eigen::Vector2d::Zero()), keys.bearings, found.size());
  for (std::size_t k = 0; k < found.size(); ++k) information.set(k, found[k], landmarks_m[k]);
  information.keep_found();

  int done = 0;
  // Returns whether one more refinement and the fix after it are predicted to end within the time budget.
  const auto is_affordable = [&] {
    if (!keys.budget_s) return true;
    const double now_s = clock_s();
    const double next_s = done > 0 ? (now_s - located_s) / done : looked_s - begin_s;
    const double last_fix_s = located_s - looked_s;
    return now_s - begin_s + next_s + last_fix_s <= *keys.budget_s;
  };
  bool is_current = true;  // whether the fix uses the latest measurements
  while (!left.empty() && is_affordable()) {
    const auto refined_m2 = [&](const Unit& unit) { return information.with_refined_m2(unit.landmark, unit.share); };
    const auto next = is_guided ? std::ranges::min_element(left, {}, refined_m2) : left.begin();
    const auto [k, view, share] = *next;
    left.erase(next);
    observation.take(std::array{k}, vision::Stage::kFine, view);
    ++done;
    answer.ranges = observation.measurements();
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (stays_found(answer.ranges[i], found[i])) answer.ranges[i] = found[i];
    }
    information.set(k, answer.ranges[k], landmarks_m[k]);
    is_current = false;
    if (observation.refined() < kLeastRefined || left.empty()) continue;
    // The prediction is cheap and the fix is not, so the fix is computed only if the prediction reaches the limit.
    if (is_guided && !(std::sqrt(information.position_variance_m2()) <= keys.enough_m)) continue;
    answer.fix = locate(keys.bearings);
    is_current = true;
    if (is_enough()) return answer;
  }
  if (!is_current) answer.fix = locate(keys.bearings);
  return answer;
}

}  // namespace twocone::estimation
