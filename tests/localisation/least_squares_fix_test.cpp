// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares_fix.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/localisation/fix_cases.h"
#include "tests/support/special_doubles.h"

namespace twocone::localisation {
namespace {

using twocone::testing_support::kEps;

FixCase lab() {
  FixCase c;
  c.truth = {0.37, -0.61, 2.2};
  c.landmarks_m = {{-2.5, -2.0}, {-2.6, 0.4}, {-1.4, 2.2}, {1.7, 2.1}, {2.6, 0.3}, {1.3, -2.2}};
  return c;
}

FixCase without_noise(FixCase c) {
  c.sigma_range_m = 1e-13;
  c.sigma_bearing_rad = 1e-13;
  return c;
}

// Exact measurements by sqrt and atan2 of lengths below 5 m have a dozen roundings, and the answer has as many.
constexpr double kExact = 32 * kEps * 5;

void expect_pose(const Fix& fix, const Pose& truth, double tolerance, FixVerdict verdict = FixVerdict::kOk) {
  ASSERT_EQ(fix.verdict, verdict) << to_string(fix.verdict);
  ASSERT_TRUE(fix.position_m && fix.heading_rad && fix.covariance);
  EXPECT_NEAR(fix.position_m->x(), truth.x_m, tolerance) << "m";
  EXPECT_NEAR(fix.position_m->y(), truth.y_m, tolerance) << "m";
  EXPECT_NEAR(wrap_angle_rad(*fix.heading_rad - truth.heading_rad), 0, tolerance) << "rad";
}

/// Measurements without noise, with usual sigmas.
std::vector<LandmarkMeasurement> exact(const FixCase& c, bool has_range = true, bool has_bearing = true) {
  FixCase silent = c;
  silent.sigma_range_m = silent.sigma_bearing_rad = 0;
  std::mt19937_64 random(1);
  auto m = measure(silent, random, has_range, has_bearing);
  for (auto& one : m) {
    one.covariance << c.sigma_range_m * c.sigma_range_m, 0, 0, c.sigma_bearing_rad * c.sigma_bearing_rad;
  }
  return m;
}

TEST(LeastSquaresFix, IsExactWhereTheMeasurementsAre) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 2000; ++i) {
    const FixCase c = random_case(random, 3 + i % 5);
    // A random triple may be near a line. The loss of accuracy is in the covariance: sigma of the answer over that of a
    // range.
    const Fix fix = fix_by_least_squares(exact(c));
    ASSERT_EQ(fix.verdict, FixVerdict::kOk) << "case " << i << " " << to_string(fix.verdict);
    const double condition = std::sqrt(fix.covariance->trace()) / c.sigma_bearing_rad;
    expect_pose(fix, c.truth, kExact * std::max(1.0, condition));
    EXPECT_EQ(fix.used, int(c.landmarks_m.size()));
    EXPECT_EQ(fix.degrees_of_freedom, 2 * int(c.landmarks_m.size()) - 3);
  }
}

TEST(LeastSquaresFix, TwoLandmarksWithRangeAndBearing) {
  FixCase c = lab();
  c.landmarks_m.resize(2);
  expect_pose(fix_by_least_squares(exact(c)), c.truth, kExact * 2);
}

TEST(LeastSquaresFix, ThreeBearings) {
  FixCase c = lab();
  c.landmarks_m = {c.landmarks_m[0], c.landmarks_m[2], c.landmarks_m[4]};
  const Fix fix = fix_by_least_squares(exact(c, false, true));
  expect_pose(fix, c.truth, kExact * 4);
  EXPECT_EQ(fix.degrees_of_freedom, 0);
}

TEST(LeastSquaresFix, BearingsOnlyAnywhere) {
  std::mt19937_64 random(12);
  int given = 0;
  for (int i = 0; i < 2000; ++i) {
    const FixCase c = random_case(random, 4 + i % 3);
    const Fix fix = fix_by_least_squares(exact(c, false, true));
    if (fix.verdict != FixVerdict::kOk) continue;  // near a circle through all of them the pose is not observed
    ++given;
    const double condition = std::sqrt(fix.covariance->trace()) / c.sigma_bearing_rad;
    expect_pose(fix, c.truth, kExact * std::max(1.0, condition));
  }
  EXPECT_GT(given, 1950);
}

TEST(LeastSquaresFix, OnTheCircleThroughThreeLandmarksBearingsAreWeak) {
  FixCase c;
  c.truth = {2 * std::cos(0.3), 2 * std::sin(0.3), 1.1};
  for (const double turn : {1.2, 2.9, 4.4}) c.landmarks_m.emplace_back(2 * std::cos(turn), 2 * std::sin(turn));
  const Fix fix = fix_by_least_squares(exact(c, false, true));
  ASSERT_EQ(fix.verdict, FixVerdict::kWeak) << to_string(fix.verdict);
  ASSERT_TRUE(fix.unseen_direction);
  // Along the circle the heading turns half as fast as the place about the centre (inscribed angles), or as fast.
  const Eigen::Vector2d at = *fix.position_m;
  EXPECT_NEAR(at.norm(), 2, 0.05) << "on the circle, m";
  const double along = fix.unseen_direction->head<2>().normalized().dot(at.normalized());
  EXPECT_NEAR(along, 0, 0.05) << "tangent";
}

TEST(LeastSquaresFix, OneRangeAndTwoBearings) {
  FixCase c = lab();
  c.landmarks_m.resize(2);
  auto m = exact(c);
  m[1].range_m.reset();
  const Fix fix = fix_by_least_squares(m);
  ASSERT_TRUE(fix.position_m) << to_string(fix.verdict);
  // For the side opposite to the range, the sine law gives one answer or two; the truth is one of them.
  const bool is_first = (*fix.position_m - Eigen::Vector2d(c.truth.x_m, c.truth.y_m)).norm() < kExact * 4;
  const bool is_second =
      fix.other_position_m && (*fix.other_position_m - Eigen::Vector2d(c.truth.x_m, c.truth.y_m)).norm() < kExact * 4;
  EXPECT_TRUE(is_first || is_second);
}

TEST(LeastSquaresFix, BearingsDecideBetweenMirrorAnswers) {
  FixCase c;
  c.truth = {1, 1.5, -0.4};
  c.landmarks_m = {{0, 0}, {2, 0}, {5, 0}};
  EXPECT_EQ(fix_by_least_squares(exact(c, true, false)).verdict, FixVerdict::kAmbiguous);
  expect_pose(fix_by_least_squares(exact(c)), c.truth, kExact * 2);
  auto one_bearing = exact(c);
  one_bearing[0].bearing_rad.reset();
  one_bearing[2].bearing_rad.reset();
  const Fix both = fix_by_least_squares(one_bearing);
  ASSERT_EQ(both.verdict, FixVerdict::kAmbiguous) << "one bearing suits either side with its own heading";
  EXPECT_TRUE(both.other_heading_rad && both.other_covariance && both.other_position_m);
}

TEST(LeastSquaresFix, BearingsTooRoughToDecideLeaveBothAnswers) {
  FixCase c;
  c.truth = {1, 1.5, -0.4};
  c.landmarks_m = {{0, 0}, {2, 0}, {5, 0}};
  c.sigma_bearing_rad = 1.5;
  const Fix fix = fix_by_least_squares(exact(c));
  EXPECT_TRUE(fix.verdict == FixVerdict::kAmbiguous || fix.verdict == FixVerdict::kWeak) << to_string(fix.verdict);
}

TEST(LeastSquaresFix, ABearingOfAnyDirectionIsNone) {
  FixCase c = lab();
  c.sigma_bearing_rad = 10;
  const Fix bearings = fix_by_least_squares(exact(c, false, true));
  EXPECT_EQ(bearings.verdict, FixVerdict::kTooFew) << to_string(bearings.verdict);
  EXPECT_EQ(bearings.unusable, 6);
  const Fix ranges = fix_by_least_squares(exact(c));
  ASSERT_EQ(ranges.verdict, FixVerdict::kOk);
  EXPECT_FALSE(ranges.heading_rad) << "known to 10 rad";
  EXPECT_EQ(ranges.unusable, 0);
}

TEST(LeastSquaresFix, OneRangeAndTwoBearingsWithOneSolutionIsAnAnswer) {
  std::mt19937_64 random(18);
  int given = 0;
  for (int i = 0; i < 300; ++i) {
    auto m = exact(random_case(random, 3));
    m[0].bearing_rad.reset();
    m[1].range_m.reset();
    m[2].range_m.reset();
    given += fix_by_least_squares(m).position_m ? 1 : 0;
  }
  EXPECT_GE(given, 255) << "the others are three answers, or one of two that first order does not see";
}

TEST(LeastSquaresFix, BearingsOnTheLandmarksLineAreWeakAlongIt) {
  FixCase c;
  c.truth = {0.7, 0, 0.3};
  c.landmarks_m = {{-2, 0}, {2, 0}, {3, 0}};
  const Fix fix = fix_by_least_squares(exact(c, false, true));
  ASSERT_EQ(fix.verdict, FixVerdict::kWeak) << to_string(fix.verdict);
  EXPECT_NEAR(std::abs(fix.unseen_direction->x()), 1, 1e-3);
  EXPECT_NEAR(fix.position_m->y(), 0, 0.02) << "sigmas of 4 mrad over 2 m";
}

TEST(LeastSquaresFix, NearTheCircleThroughThreeLandmarksThereIsAnAnswer) {
  for (const double off_m : {1e-12, 1e-10, 1e-8, 1e-6, 1e-4}) {
    FixCase c;
    c.truth = {(2 + off_m) * std::cos(0.3), (2 + off_m) * std::sin(0.3), 1.1};
    for (const double turn : {1.2, 2.9, 4.4}) c.landmarks_m.emplace_back(2 * std::cos(turn), 2 * std::sin(turn));
    const Fix fix = fix_by_least_squares(exact(c, false, true));
    ASSERT_EQ(fix.verdict, FixVerdict::kWeak) << off_m << " " << to_string(fix.verdict);
    EXPECT_NEAR(fix.position_m->norm(), 2, 0.05) << off_m;
  }
}

TEST(LeastSquaresFix, FarBeaconsEndAtTheMinimum) {
  // Residuals of metres bend the minimum, so that Gauss-Newton approaches it only slowly.
  std::mt19937_64 random(19);
  std::uniform_real_distribution<double> far(500, 1500);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    std::vector<LandmarkMeasurement> m;
    for (int k = 0; k < 4; ++k) {
      const double to = turn(random);
      const double distance_m = far(random);
      const double sigma_m = 60;
      LandmarkMeasurement one{.landmark_m = distance_m * Eigen::Vector2d(std::cos(to), std::sin(to)),
                              .range_m = distance_m + sigma_m * normal(random),
                              .bearing_rad = {}};
      one.covariance(0, 0) = sigma_m * sigma_m;
      m.push_back(one);
    }
    const Fix fix = fix_by_least_squares(m);
    if (fix.verdict != FixVerdict::kOk || !fix.outliers.empty()) continue;
    // Compute Newton's own step there, from the definition.
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();
    for (const auto& one : m) {
      const Eigen::Vector2d d = *fix.position_m - one.landmark_m;
      const Eigen::Vector2d u = d.normalized();
      const double e = d.norm() - *one.range_m;
      slope += e * u;
      bend += u * u.transpose() + e / d.norm() * (Eigen::Matrix2d::Identity() - u * u.transpose());
    }
    // Lengths are 1,500 m and rows have one size: the bound is the condition of the bend times the roundings of a row.
    const Eigen::Vector2d step = bend.inverse() * slope;
    EXPECT_LT(step.norm(), 64 * kEps * 1500 * bend.norm() * bend.inverse().norm()) << i;
  }
}

TEST(LeastSquaresFix, HeadingAtPiDoesNotTear) {
  for (const double heading_rad :
       {std::numbers::pi, -std::numbers::pi, std::nextafter(std::numbers::pi, 0.0), std::numbers::pi - 1e-9}) {
    FixCase c = lab();
    c.truth.heading_rad = heading_rad;
    const Fix fix = fix_by_least_squares(exact(c));
    expect_pose(fix, c.truth, kExact);
    EXPECT_LE(std::abs(*fix.heading_rad), std::numbers::pi);
  }
}

TEST(LeastSquaresFix, BearingsMayHoldTurns) {
  auto m = exact(lab());
  *m[1].bearing_rad += 2 * std::numbers::pi;
  *m[4].bearing_rad -= 6 * std::numbers::pi;
  expect_pose(fix_by_least_squares(m), lab().truth, kExact);
}

TEST(LeastSquaresFix, OrderIsOfNoAccount) {
  std::mt19937_64 random(13);
  auto m = measure(lab(), random);
  const Fix a = fix_by_least_squares(m);
  std::swap(m[0], m[5]);
  std::swap(m[1], m[3]);
  const Fix b = fix_by_least_squares(m);
  EXPECT_LT((*a.position_m - *b.position_m).norm(), kExact);
  EXPECT_NEAR(a.chi_squared, b.chi_squared, 1e-9 * (1 + a.chi_squared))
      << "residuals of 1e-2, each right to 1e-13 of it";
}

TEST(LeastSquaresFix, MoreLandmarksThanTheStackHolds) {
  std::mt19937_64 random(14);
  for (const int count : {32, 33, 60}) {
    const FixCase c = random_case(random, count);
    auto m = measure(c, random);
    const Fix fix = fix_by_least_squares(m);
    ASSERT_EQ(fix.verdict, FixVerdict::kOk) << count;
    EXPECT_LT((fix.covariance->inverse() * error_of(fix, c.truth)).dot(error_of(fix, c.truth)), 21.1) << "1e-4";
    *m[7].range_m += 0.5;
    *m[20].bearing_rad += 0.3;
    const Fix cleaned = fix_by_least_squares(m);
    ASSERT_EQ(cleaned.verdict, FixVerdict::kOk) << count << " " << to_string(cleaned.verdict);
    EXPECT_EQ(cleaned.outliers, (std::vector<int>{7, 20})) << count;
  }
}

TEST(LeastSquaresFix, CorrelationCounts) {
  // By hand: if one landmark's range error e_r is known from elsewhere, the expected value of its bearing shifts by rho
  // sb / sr e_r. The covariance of the pose is (sum J^T C^-1 J)^-1.
  FixCase c = lab();
  c.correlation = 0.8;
  c.sigma_range_m = 0.03;
  c.sigma_bearing_rad = 0.01;
  auto m = exact(c);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (auto& one : m) {
    one.covariance(0, 1) = one.covariance(1, 0) = 0.8 * 0.03 * 0.01;
    const Eigen::Vector2d d = one.landmark_m - Eigen::Vector2d(c.truth.x_m, c.truth.y_m);
    const double r = d.norm();
    Eigen::Matrix<double, 2, 3> j;
    j << -d.x() / r, -d.y() / r, 0, d.y() / (r * r), -d.x() / (r * r), -1;
    information += j.transpose() * one.covariance.inverse() * j;
  }
  const Fix fix = fix_by_least_squares(m);
  ASSERT_EQ(fix.verdict, FixVerdict::kOk);
  const Eigen::Matrix3d expected = information.inverse();
  // There are two inversions with a condition of some 1e4.
  EXPECT_LT((*fix.covariance - expected).cwiseAbs().maxCoeff(), 1e-11 * expected.maxCoeff()) << *fix.covariance;
}

TEST(LeastSquaresFix, HugeTinyAndFarWorlds) {
  for (const double s : {1e-150, 1e-30, 1.0, 1e30, 1e150}) {
    FixCase c = lab();
    c.truth.x_m *= s;
    c.truth.y_m *= s;
    for (auto& l : c.landmarks_m) l *= s;
    c.sigma_range_m *= s;
    const Fix fix = fix_by_least_squares(exact(c));
    ASSERT_EQ(fix.verdict, FixVerdict::kOk) << s << " " << to_string(fix.verdict);
    EXPECT_NEAR(fix.position_m->x() / s, lab().truth.x_m, kExact) << s;
    EXPECT_NEAR(fix.position_m->y() / s, lab().truth.y_m, kExact) << s;
    EXPECT_NEAR(*fix.heading_rad, c.truth.heading_rad, kExact) << s;
    EXPECT_TRUE(fix.covariance->allFinite());
  }
}

// A landmark is far out and no range is a number, so there is no usual size to compare with.
TEST(LeastSquaresFix, InfiniteRangesBesideAFarLandmarkGiveNoFix) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<LandmarkMeasurement> all(6);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].landmark_m = {double(i), i == 0 ? 1e200 : double(i % 2)};
    all[i].range_m = kInfinite;
    all[i].covariance = Eigen::Matrix2d::Identity();
  }
  EXPECT_FALSE(fix_by_least_squares(all).position_m);
}

/// No input gives an invalid number, and none hangs (the test's time-out checks that).
TEST(LeastSquaresFix, NothingThatIsNoNumberComesOut) {
  const std::vector<double> odd = {0,
                                   -0.0,
                                   1,
                                   -1,
                                   1e-320,
                                   4.9e-324,
                                   1e150,
                                   -1e150,
                                   1e-150,
                                   1e308,
                                   -1e308,
                                   3.3,
                                   1e16,
                                   kEps,
                                   2.5,
                                   std::numeric_limits<double>::infinity(),
                                   std::numeric_limits<double>::quiet_NaN()};
  std::mt19937_64 random(15);
  std::uniform_int_distribution<std::size_t> pick(0, odd.size() - 1);
  std::uniform_int_distribution<int> coin(0, 3);
  int given = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<LandmarkMeasurement> all(1 + std::size_t(i % 7));
    for (auto& m : all) {
      m.landmark_m = {odd[pick(random)], odd[pick(random)]};
      if (coin(random)) m.range_m = odd[pick(random)];
      if (coin(random)) m.bearing_rad = odd[pick(random)];
      if (coin(random) == 0) {
        const double a = odd[pick(random)];
        m.covariance << std::abs(odd[pick(random)]), a, a, std::abs(odd[pick(random)]);
      }
    }
    const Fix fix = fix_by_least_squares(all);
    EXPECT_EQ(fix.position_m.has_value(),
              fix.verdict != FixVerdict::kTooFew && fix.verdict != FixVerdict::kContradictory);
    EXPECT_FALSE(std::isnan(fix.chi_squared)) << "case " << i;
    if (!fix.position_m) continue;
    ++given;
    EXPECT_TRUE(fix.position_m->allFinite() && fix.covariance->allFinite()) << "case " << i;
    EXPECT_TRUE(!fix.heading_rad || std::isfinite(*fix.heading_rad)) << "case " << i;
    EXPECT_TRUE(!fix.other_position_m || (fix.other_position_m->allFinite() && fix.other_covariance->allFinite()));
    EXPECT_EQ(fix.unseen_direction.has_value(), fix.verdict == FixVerdict::kWeak);
    if (fix.unseen_direction) {
      EXPECT_NEAR(fix.unseen_direction->norm(), 1, 4 * kEps) << "case " << i;
    }
    EXPECT_GE(fix.covariance->diagonal().minCoeff(), 0) << "case " << i;
  }
  EXPECT_GT(given, 10);
}

TEST(PoseBound, ByHand) {
  // The robot is at the origin with any heading; landmarks are at (2, 0), (0, 3); sigmas are 0.1 m and 0.05 rad.
  // Rows: (-1 0 0) 10, (0 -1/2 -1) 20; (0 -1 0) 10, (1/3 0 -1) 20.
  // Information: xx 100 + 400/9, xh -400/3; yy 100 + 100, yh 200; hh 800; xy 0.
  const Eigen::Matrix2d information = Eigen::Vector2d(100, 400).asDiagonal();
  const std::vector<Eigen::Vector2d> landmarks_m = {{2, 0}, {0, 3}};
  const auto bound = pose_bound({0, 0, 0.3}, landmarks_m, std::vector<Eigen::Matrix2d>(2, information));
  ASSERT_TRUE(bound);
  Eigen::Matrix3d sum;
  sum << 100 + 400.0 / 9, 0, -400.0 / 3, 0, 200, 200, -400.0 / 3, 200, 800;
  EXPECT_LT((*bound * sum - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 64 * kEps * 10) << "condition 10";
  // hh by elimination: 800 - (400/3)^2 / (1300/9) - 200 = 600 - 1600/13.
  EXPECT_NEAR((*bound)(2, 2), 1 / (600 - 1600.0 / 13), 64 * kEps / 400);
}

TEST(PoseBound, NothingWhereThePoseIsNotSeen) {
  const Eigen::Matrix2d ranges = Eigen::Vector2d(1e4, 0).asDiagonal();
  const Eigen::Matrix2d both = Eigen::Vector2d(1e4, 1e5).asDiagonal();
  const std::vector<Eigen::Vector2d> one = {{2, 1}};
  const std::vector<Eigen::Vector2d> two = {{2, 1}, {-1, 3}};
  EXPECT_FALSE(pose_bound({}, {}, {}));
  EXPECT_FALSE(pose_bound({}, one, std::vector{both})) << "the robot may turn round one landmark";
  EXPECT_FALSE(pose_bound({}, two, std::vector{ranges, ranges})) << "no heading";
  EXPECT_TRUE(pose_bound({}, two, std::vector{both, ranges})) << "singular parts are well";
  EXPECT_FALSE(pose_bound({2, 1, 0}, one, std::vector{both}));
  const Eigen::Matrix2d nan = Eigen::Matrix2d::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(pose_bound({}, two, std::vector{both, nan}));
  EXPECT_THROW(pose_bound({}, two, std::vector{both}), std::invalid_argument);
}

TEST(PoseBound, IsTheCovarianceOfAFix) {
  const FixCase c = without_noise(lab());
  std::mt19937_64 random(16);
  auto m = measure(c, random);
  std::vector<Eigen::Matrix2d> information;
  for (auto& one : m) {
    one.covariance << 1e-4, 3e-5, 3e-5, 4e-5;
    information.emplace_back(one.covariance.inverse());
  }
  const auto bound = pose_bound(c.truth, c.landmarks_m, information);
  ASSERT_TRUE(bound);
  // The fix is within 1e-13 of the truth, for lengths of metres.
  EXPECT_LT((*bound - *fix_by_least_squares(m).covariance).cwiseAbs().maxCoeff(), 1e-11 * bound->maxCoeff());
}

}  // namespace
}  // namespace twocone::localisation
