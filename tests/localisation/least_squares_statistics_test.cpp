// SPDX-License-Identifier: Apache-2.0
// Checks the stated covariances and verdicts statistically, over seeded noise.
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/localisation/fix_cases.h"

namespace twocone::localisation {
namespace {

/// 95 % quantiles of chi-squared of two numbers and of one.
constexpr double kTwo95 = 5.991;
constexpr double kOne95 = 3.841;

const std::vector<Eigen::Vector2d> kLab = {{-2.5, -2.0}, {-2.6, 0.4}, {-1.4, 2.2}, {1.7, 2.1}, {2.6, 0.3}, {1.3, -2.2}};

double position_distance2(const Fix& fix, const Eigen::Vector3d& error) {
  const Eigen::Matrix2d c = fix.covariance->topLeftCorner<2, 2>();
  return error.head<2>().dot(c.inverse() * error.head<2>());
}

struct Tally {
  int given = 0;
  int position_inside = 0;
  int heading_inside = 0;
  double position_error2_m2 = 0;
  double position_bound_m2 = 0;
  double heading_error2 = 0;
  double heading_bound = 0;
};

Tally run(int count, bool has_range, bool has_bearing, double correlation) {
  std::mt19937_64 random(2024);
  std::uniform_real_distribution<double> place(-1.8, 1.8);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  Tally t;
  for (int i = 0; i < count; ++i) {
    const FixCase c{
        .truth = {place(random), place(random), turn(random)}, .landmarks_m = kLab, .correlation = correlation};
    const auto m = measure(c, random, has_range, has_bearing);
    const Fix fix = fix_by_least_squares(m);
    if (fix.verdict != FixVerdict::kOk || !fix.outliers.empty()) continue;
    ++t.given;
    const Eigen::Vector3d error = error_of(fix, c.truth);
    t.position_inside += position_distance2(fix, error) < kTwo95;
    t.position_error2_m2 += error.head<2>().squaredNorm();
    std::vector<Eigen::Matrix2d> information;
    for (const auto& one : m) {
      Eigen::Matrix2d is = Eigen::Matrix2d::Zero();
      if (has_range && has_bearing) {
        is = one.covariance.inverse();
      } else if (has_range) {
        // There is no bound without a heading. Use one with a sigma of 1 krad, which does not affect the position.
        is = Eigen::Vector2d(1 / one.covariance(0, 0), 1e-6).asDiagonal();
      } else {
        is(1, 1) = 1 / one.covariance(1, 1);
      }
      information.push_back(is);
    }
    const auto bound = pose_bound(c.truth, c.landmarks_m, information);
    if (!bound) {
      ADD_FAILURE() << "case " << i << ": no bound";
      return t;
    }
    t.position_bound_m2 += (*bound)(0, 0) + (*bound)(1, 1);
    if (!has_bearing) continue;
    t.heading_inside += error.z() * error.z() < kOne95 * (*fix.covariance)(2, 2);
    t.heading_error2 += error.z() * error.z();
    t.heading_bound += (*bound)(2, 2);
  }
  return t;
}

void expect_true(const Tally& t, int count, bool has_heading) {
  // False alarms exclude 2e-4 * 4000 = 0.8 of 4000; 8 or more have a probability of 1e-6.
  EXPECT_GT(t.given, count - 8);
  // 95 % of 4000 scatters by 0.34 %: 93 and 97 % are six of these sigmas away.
  EXPECT_GT(t.position_inside, 0.93 * t.given);
  EXPECT_LT(t.position_inside, 0.97 * t.given);
  // The root mean square of 4000 pairs scatters by 0.8 %.
  EXPECT_NEAR(std::sqrt(t.position_error2_m2 / t.position_bound_m2), 1, 0.05);
  ::testing::Test::RecordProperty("position_inside_95", std::to_string(100.0 * t.position_inside / t.given));
  ::testing::Test::RecordProperty("rmse_over_bound",
                                  std::to_string(std::sqrt(t.position_error2_m2 / t.position_bound_m2)));
  if (!has_heading) return;
  EXPECT_GT(t.heading_inside, 0.93 * t.given);
  EXPECT_LT(t.heading_inside, 0.97 * t.given);
  EXPECT_NEAR(std::sqrt(t.heading_error2 / t.heading_bound), 1, 0.05);
}

TEST(LeastSquaresStatistics, EllipsesHoldTheTruthAndTheBoundIsReached) {
  expect_true(run(4000, true, true, 0), 4000, true);
}
TEST(LeastSquaresStatistics, WithCorrelatedRangesAndBearings) { expect_true(run(4000, true, true, 0.7), 4000, true); }
TEST(LeastSquaresStatistics, RangesOnly) { expect_true(run(4000, true, false, 0), 4000, false); }
TEST(LeastSquaresStatistics, BearingsOnly) { expect_true(run(4000, false, true, 0), 4000, true); }

TEST(LeastSquaresStatistics, FalseAlarmsAreAsOftenAsStated) {
  std::mt19937_64 random(31);
  constexpr int kFixes = 20000;
  int alarms = 0;
  for (int i = 0; i < kFixes; ++i) {
    const FixCase c{.truth = {0.3, -0.4, 1}, .landmarks_m = kLab};
    const Fix fix = fix_by_least_squares(measure(c, random));
    alarms += fix.verdict != FixVerdict::kOk || !fix.outliers.empty();
  }
  // At most 2e-4 of them are alarms, 1e-4 by each test. So at most 4 are expected; more than 14 have a probability of
  // 1e-5.
  EXPECT_LE(alarms, 14);
  EXPECT_GE(alarms, 1) << "a test that never raises its alarm is none";
}

TEST(LeastSquaresOutliers, TwoOfSixAreFoundAndNamed) {
  std::mt19937_64 random(32);
  int tried = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      for (int side = 0; side < 8; ++side) {
        const FixCase c{.truth = {0.3, -0.4, 1}, .landmarks_m = kLab};
        auto m = measure(c, random);
        *m[std::size_t(i)].range_m += side & 1 ? 0.5 : -0.5;
        if (side & 4) {  // the landmark itself is elsewhere
          m[std::size_t(j)].landmark_m.y() += side & 2 ? 0.5 : -0.5;
        } else {
          *m[std::size_t(j)].range_m += side & 2 ? 0.5 : -0.5;
        }
        const Fix fix = fix_by_least_squares(m);
        ASSERT_EQ(fix.verdict, FixVerdict::kOk) << i << " " << j << " " << side << " " << to_string(fix.verdict);
        EXPECT_EQ(fix.outliers, (std::vector<int>{j, i}));
        EXPECT_EQ(fix.used, 4);
        EXPECT_LT(position_distance2(fix, error_of(fix, c.truth)), 18.4) << "1e-4";
        ++tried;
      }
    }
  }
  EXPECT_EQ(tried, 120);
}

TEST(LeastSquaresOutliers, TwoOfFourContradict) {
  std::mt19937_64 random(33);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j) {
      FixCase c{.truth = {0.3, -0.4, 1}, .landmarks_m = kLab};
      c.landmarks_m.resize(4);
      auto m = measure(c, random);
      *m[std::size_t(i)].range_m += 0.5;
      *m[std::size_t(j)].range_m += 0.5;
      const Fix fix = fix_by_least_squares(m);
      EXPECT_EQ(fix.verdict, FixVerdict::kContradictory) << i << " " << j << " " << to_string(fix.verdict);
      EXPECT_FALSE(fix.position_m);
    }
  }
}

/// The observable effect of a shift of landmark 0, to first order.
/// @returns the root of the non-centrality of its leave-one-out statistic, in sigmas
double shown_by_others(const FixCase& c, const std::vector<LandmarkMeasurement>& m, bool has_bearing) {
  const int n = has_bearing ? 3 : 2;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd first;
  Eigen::VectorXd error;
  for (std::size_t i = 0; i < m.size(); ++i) {
    // Rows are at the landmark's place in the map; the difference is the effect of its shift.
    const Eigen::Vector2d d = m[i].landmark_m - Eigen::Vector2d(c.truth.x_m, c.truth.y_m);
    const Eigen::Vector2d stands = c.landmarks_m[i] - Eigen::Vector2d(c.truth.x_m, c.truth.y_m);
    const double r = d.norm();
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(has_bearing ? 2 : 1, n);
    Eigen::VectorXd e(j.rows());
    j(0, 0) = -d.x() / r / c.sigma_range_m;
    j(0, 1) = -d.y() / r / c.sigma_range_m;
    e(0) = (stands.norm() - r) / c.sigma_range_m;
    if (has_bearing) {
      j(1, 0) = d.y() / r / r / c.sigma_bearing_rad;
      j(1, 1) = -d.x() / r / r / c.sigma_bearing_rad;
      j(1, 2) = -1 / c.sigma_bearing_rad;
      e(1) = wrap_angle_rad(std::atan2(stands.y(), stands.x()) - std::atan2(d.y(), d.x())) / c.sigma_bearing_rad;
    }
    information += j.transpose() * j;
    if (i == 0) {
      first = j;
      error = e;
    }
  }
  const Eigen::MatrixXd covariance = information.inverse();
  const Eigen::MatrixXd leverage = first * covariance * first.transpose();
  return std::sqrt(error.dot(error - leverage * error));
}

struct Verdicts {
  int ok = 0;
  int named = 0;
  int wrong = 0;    ///< verdict ok, more than 6 sigma off
  int unshown = 0;  ///< of these, in rooms whose measurements do not show the outlier
};

/// 10 000 rooms of `count` landmarks, one of which is `off_m` from its place in the map.
Verdicts one_outlier(int count, bool has_bearing, double off_m) {
  std::mt19937_64 random(34);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  // The leave-one-out statistic's threshold, in sigmas; noise reduces the statistic by 4.3 of them once in 1e5.
  const double threshold = std::sqrt(2 * std::log(count / 1e-4));
  Verdicts v;
  for (int i = 0; i < 10000; ++i) {
    const FixCase c = random_case(random, count);
    auto m = measure(c, random, true, has_bearing);
    const double to = turn(random);
    m[0].landmark_m += off_m * Eigen::Vector2d(std::cos(to), std::sin(to));
    const Fix fix = fix_by_least_squares(m);
    if (fix.verdict != FixVerdict::kOk) continue;
    ++v.ok;
    v.named += fix.outliers == std::vector<int>{0};
    if (position_distance2(fix, error_of(fix, c.truth)) <= 36) continue;
    ++v.wrong;
    v.unshown += shown_by_others(c, m, has_bearing) < threshold + 4.3;
  }
  ::testing::Test::RecordProperty("ok_named_wrong_unshown", std::to_string(v.ok) + " " + std::to_string(v.named) + " " +
                                                                std::to_string(v.wrong) + " " +
                                                                std::to_string(v.unshown));
  return v;
}

// The probability of a wrong answer without notice, where the measurements show the outlier: either the true
// explanation is rejected by a false alarm of its own (2e-4) while another one alone is accepted, or the outlier is not
// seen (1e-5). That is 2.1 of 10 000 rooms if another explanation is always accepted, and 8 have a probability of 1e-3.
// It is an upper bound, since another explanation is seldom accepted.
constexpr int kMostWrong = 8;

TEST(LeastSquaresOutliers, OneOfSixWithBearingsIsNeverQuietlyWrong) {
  const Verdicts v = one_outlier(6, true, 0.5);
  EXPECT_LE(v.wrong, kMostWrong);
  EXPECT_EQ(v.unshown, 0);
  // Fixes lost to false alarms, of the full set or of the five left: 2e-4 each.
  EXPECT_GT(v.ok, 9980);
  EXPECT_GT(v.named, 9980);
}

TEST(LeastSquaresOutliers, OneOfFourWithBearingsIsNeverQuietlyWrong) {
  const Verdicts v = one_outlier(4, true, 0.5);
  EXPECT_LE(v.wrong, kMostWrong);
  EXPECT_GT(v.named, 9950);
}

TEST(LeastSquaresOutliers, OneOfSixRangesIsWrongOnlyWhereTheRangesDoNotShowIt) {
  // With ranges alone, a landmark is moved in any direction. Where it moves across the line of sight, or determines
  // much of the answer, the forecast of its range by the others is no better than its error, and no method can detect
  // it. These rooms are counted separately.
  const Verdicts v = one_outlier(6, false, 0.5);
  EXPECT_LE(v.wrong - v.unshown, kMostWrong);
  EXPECT_LE(v.unshown, 50) << "half a percent";
  EXPECT_GT(v.ok, 9500);
}

}  // namespace
}  // namespace twocone::localisation
