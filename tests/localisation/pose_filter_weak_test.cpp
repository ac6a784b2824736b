// SPDX-License-Identifier: Apache-2.0
// Weak fixes in the filter: whether its stated regions contain the truth as often as they should, and whether a track
// gains by them.
// TWOCONE_CASES=N: number of draws instead of some hundred.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/localisation/a_drive.h"
#include "tests/localisation/fix_cases.h"
#include "tests/support/cases.h"

namespace twocone::localisation {
namespace {

/// Values that chi-squared of three numbers exceeds in half, and in 0.1 %, of all cases.
constexpr double kHalf = 2.366;
constexpr double kAllButAThousandth = 16.266;

double distance2(const Eigen::Vector3d& truth, const PoseEstimate& e) {
  const Eigen::Vector3d error(e.pose.x_m - truth.x(), e.pose.y_m - truth.y(),
                              wrap_angle_rad(e.pose.heading_rad - truth.z()));
  return error.dot(e.covariance.ldlt().solve(error));
}

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double normal() { return normal_(random_); }
  double between(double low, double high) { return low + (high - low) * uniform_(random_); }
  double log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  int one_of(int count) { return std::min(count - 1, int(between(0, count))); }

  /// Measurements of landmarks in a small group, or in line, which mostly give weak fixes.
  std::vector<LandmarkMeasurement> group(const Eigen::Vector3d& truth) {
    std::vector<LandmarkMeasurement> all;
    const double spacing_m = log_between(0.03, 0.3);
    const double away_m = between(1, 8);
    const double way_rad = between(-std::numbers::pi, std::numbers::pi);
    const double line_rad = between(-std::numbers::pi, std::numbers::pi);
    const double sigma_m = log_between(0.001, 0.03);
    const double sigma_rad = log_between(0.0005, 0.05);
    const Eigen::Vector2d middle = truth.head<2>() + away_m * Eigen::Vector2d(std::cos(way_rad), std::sin(way_rad));
    const int count = 2 + one_of(3);
    const bool is_line = one_of(2) == 0;
    const int bearings = one_of(3);  // none, of one landmark, of all
    for (int i = 0; i < count; ++i) {
      Eigen::Vector2d place = middle;
      if (is_line) {
        place += spacing_m * i * Eigen::Vector2d(std::cos(line_rad), std::sin(line_rad));
      } else {
        place += spacing_m * Eigen::Vector2d(normal(), normal());
      }
      const Eigen::Vector2d to = place - truth.head<2>();
      LandmarkMeasurement m = ranged(place.x(), place.y(), std::max(0.0, to.norm() + sigma_m * normal()), sigma_m);
      if (bearings == 2 || (bearings == 1 && i == 0)) {
        m.bearing_rad = wrap_angle_rad(std::atan2(to.y(), to.x()) - truth.z() + sigma_rad * normal());
        m.covariance(1, 1) = sigma_rad * sigma_rad;
      }
      all.push_back(m);
    }
    return all;
  }

  std::pair<Eigen::Vector3d, Eigen::Matrix3d> prior() {
    Eigen::Matrix3d root;
    for (double& value : root.reshaped()) value = normal();
    const Eigen::Vector3d sigma(log_between(0.001, 0.5), log_between(0.001, 0.5), log_between(0.001, 0.2));
    Eigen::Matrix3d c = root * root.transpose() + 0.1 * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d scale = sigma.cwiseQuotient(c.diagonal().cwiseSqrt());
    c = scale.asDiagonal() * c * scale.asDiagonal();
    return {Eigen::Vector3d(between(-3, 3), between(-3, 3), between(-std::numbers::pi, std::numbers::pi)),
            (c + c.transpose()) / 2};
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

// Catches the use of a far place's tangent: then the truth is outside the 99.9 % region in half of the draws.
TEST(PoseFilterWeak, RegionsHoldWhatTheySay) {
  Draw draw(2001);
  int taken = 0;
  int half = 0;
  int nearly_all = 0;
  int uses[16] = {};
  double before2 = 0;
  double after2 = 0;
  int weak = 0;
  const int wanted = testing_support::cases(400);
  while (weak < wanted) {
    const auto [mean, covariance] = draw.prior();
    const Eigen::Matrix3d root = covariance.llt().matrixL();
    const Eigen::Vector3d truth = mean + root * Eigen::Vector3d(draw.normal(), draw.normal(), draw.normal());
    const Fix fix = fix_by_least_squares(draw.group(truth));
    if (fix.verdict != FixVerdict::kWeak) continue;
    ++weak;
    PoseFilter filter = filter_at({mean.x(), mean.y(), mean.z()}, covariance);
    const FixUse use = filter.correct(fix);
    ++uses[int(use)];
    if (use != FixUse::kTaken) continue;
    ++taken;
    const PoseEstimate e = *filter.estimate();
    const double d2 = distance2(truth, e);
    half += d2 < kHalf;
    nearly_all += d2 < kAllButAThousandth;
    before2 += (mean - truth).head<2>().squaredNorm();
    after2 += (Eigen::Vector2d(e.pose.x_m, e.pose.y_m) - truth.head<2>()).squaredNorm();
  }
  std::printf("weak %d taken %d not_gaussian %d unexpected %d inside_50 %.2f inside_999 %.3f rmse_mm %.2f -> %.2f\n",
              weak, taken, uses[int(FixUse::kNotGaussian)], uses[int(FixUse::kUnexpected)], 100.0 * half / taken,
              100.0 * nearly_all / taken, 1e3 * std::sqrt(before2 / taken), 1e3 * std::sqrt(after2 / taken));
  ASSERT_GT(taken, wanted / 2);
  EXPECT_GT(half, 0.45 * taken);
  EXPECT_LT(half, 0.55 * taken);
  EXPECT_GE(nearly_all, 0.995 * taken - 1);  // one more of few, by chance
  EXPECT_LT(after2, before2);
  EXPECT_LE(uses[int(FixUse::kUnexpected)], 1) << "once in a million";
}

// The filter's sigma is 0.3 m where three ranges determine an arc of 5 m. The tangent at the fix's own place, 1.3 m
// along the arc, is 0.17 m off here.
TEST(PoseFilterWeak, TheTruthIsInTheRegionWhereTheArcIsBent) {
  const std::vector<LandmarkMeasurement> ranges{ranged(0, 0, 5, 0.01), ranged(0.1, 0, 4.9, 0.01),
                                                ranged(0, 0.1, std::hypot(5, 0.1) - 0.0136, 0.01)};
  const Fix fix = fix_by_least_squares(ranges);
  ASSERT_EQ(fix.verdict, FixVerdict::kWeak);
  ASSERT_EQ(fix.measurements.size(), 3U);
  const Eigen::Vector3d truth(5, 0, 0);
  for (const double sigma_m : {0.3, 0.1, 0.03, 0.01}) {
    const Eigen::Matrix3d prior = Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, 0.01).asDiagonal();
    PoseFilter filter = filter_at({truth.x(), truth.y(), truth.z()}, prior);
    const FixUse use = filter.correct(fix);
    EXPECT_LT(distance2(truth, *filter.estimate()), kAllButAThousandth) << sigma_m;
    if (sigma_m > 0.1) continue;  // beyond this, the arc leaves its ellipse
    EXPECT_EQ(use, FixUse::kTaken) << sigma_m;
    EXPECT_LT(std::sqrt(filter.estimate()->covariance(0, 0)), 0.01) << "the ranges determine x";
  }
}

// By hand: a range along x, far away, is a measurement of x.
TEST(PoseFilterWeak, UpdatesAcrossTheUnseenDirectionOnly) {
  Fix fix;
  fix.verdict = FixVerdict::kWeak;
  fix.measurements = {ranged(1e6 + 0.1, 0, 1e6, 0.1)};
  PoseFilter filter = filter_at({}, 0.01 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(filter.correct(fix), FixUse::kTaken);
  const PoseEstimate e = *filter.estimate();
  constexpr double kRounding = 1e-8;  // some roundings of 1e6 m
  EXPECT_NEAR(e.pose.x_m, 0.05, kRounding) << "equal sigmas: the middle";
  EXPECT_NEAR(e.pose.y_m, 0, kRounding);
  EXPECT_NEAR(e.covariance(0, 0), 0.005, kRounding);
  EXPECT_NEAR(e.covariance(1, 1), 0.01, kRounding);
  EXPECT_NEAR(e.covariance(2, 2), 0.01, kRounding);

  fix.widening = 3;  // the range then has a sigma of 0.17 m
  PoseFilter wide = filter_at({}, 0.01 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(wide.correct(fix), FixUse::kTaken);
  EXPECT_NEAR(wide.estimate()->pose.x_m, 0.025, kRounding);

  fix.measurements = {ranged(1e6 + 1, 0, 1e6, 0.01)};
  PoseFilter far = filter_at({}, 0.01 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(far.correct(fix), FixUse::kUnexpected) << "10 sigmas off";
  EXPECT_EQ(far.estimate()->pose.x_m, 0);
  fix.measurements.clear();
  EXPECT_EQ(far.correct(fix), FixUse::kNoSigma);
  EXPECT_EQ(PoseFilter(kWheels, kNoise).correct(fix), FixUse::kCannotStart);
}

// Catches an ellipse round one of two places: two ranges and a prior that contains both mirror images.
TEST(PoseFilterWeak, TwoPlacesAreNoEllipse) {
  Fix fix;
  fix.verdict = FixVerdict::kWeak;
  fix.measurements = {ranged(-2, 0, std::hypot(2, 0.3), 0.01), ranged(2, 0, std::hypot(2, 0.3), 0.01)};
  PoseFilter vague = filter_at({0, 0.05, 0}, Eigen::Vector3d(0.09, 0.09, 0.01).asDiagonal());
  EXPECT_EQ(vague.correct(fix), FixUse::kNotGaussian);
  PoseFilter sure = filter_at({0, 0.25, 0}, Eigen::Vector3d(0.0025, 0.0025, 0.01).asDiagonal());
  EXPECT_EQ(sure.correct(fix), FixUse::kTaken);
  EXPECT_NEAR(sure.estimate()->pose.y_m, 0.3, 0.07) << "its own side";
}

// Catches a filter that would be better without weak fixes.
TEST(PoseFilterWeak, ATrackWithThemIsBetterThanWithout) {
  const int runs = std::max(20, testing_support::cases(400) / 50);
  constexpr int kFrames = 150;  // 10 s
  double with2 = 0;
  double without2 = 0;
  int inside = 0;
  int taken = 0;
  for (int run = 0; run < runs; ++run) {
    Drive drive(7000 + std::uint64_t(run));
    Draw draw(8000 + std::uint64_t(run));
    PoseFilter with(kWheels, kNoise);
    PoseFilter without(kWheels, kNoise);
    for (int i = 0; i <= kFrames; ++i) {
      if (i > 0) drive.step();
      drive.report_readings(with);
      drive.report_readings(without);
      if (i == 0) {
        const Fix start = drive.fix();
        with.correct(start);
        without.correct(start);
        continue;
      }
      const Pose& at = drive.truth();
      std::vector<LandmarkMeasurement> ranges;
      for (const auto& [x_m, y_m] : {std::pair{3.0, 2.0}, {3.1, 2.0}, {3.0, 2.1}}) {
        ranges.push_back(ranged(x_m, y_m, std::hypot(x_m - at.x_m, y_m - at.y_m) + 0.005 * draw.normal(), 0.005));
      }
      const Fix fix = fix_by_least_squares(ranges);
      if (fix.verdict == FixVerdict::kWeak) taken += with.correct(fix) == FixUse::kTaken;
    }
    const Pose& at = drive.truth();
    with2 += drive.error(with.estimate()->pose).head<2>().squaredNorm();
    without2 += drive.error(without.estimate()->pose).head<2>().squaredNorm();
    inside += distance2({at.x_m, at.y_m, at.heading_rad}, *with.estimate()) < kAllButAThousandth;
  }
  std::printf("runs %d taken %d rmse_mm without %.2f with %.2f inside_999 %d\n", runs, taken,
              1e3 * std::sqrt(without2 / runs), 1e3 * std::sqrt(with2 / runs), inside);
  EXPECT_GT(taken, runs * kFrames / 2);
  EXPECT_LT(with2, 0.8 * without2);
  EXPECT_GE(inside, runs - 1 - runs / 200);
}

}  // namespace
}  // namespace twocone::localisation
