// SPDX-License-Identifier: Apache-2.0
// The trilateration cases by name. Ranges have a sigma of 0.01 m unless stated otherwise.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "tests/localisation/fix_cases.h"
#include "tests/support/special_doubles.h"

namespace twocone::localisation {
namespace {

using twocone::testing_support::kEps;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

Fix solve(const std::vector<LandmarkMeasurement>& measurements) { return fix_by_least_squares(measurements); }

/// Each range and coordinate is rounded to half a spacing of the largest length, and the iteration ends with a step of
/// one spacing; the answer moves by `condition` times that. The factor 8 is for the dozen roundings of one row.
double bound_m(double largest_m, double condition) { return 8 * kEps * largest_m * condition; }

/// Relative error of values that the list gives with six digits.
constexpr double kSixDigits = 1e-5;

void expect_covariance(const Eigen::Matrix3d& c, double xx, double xy, double yy) {
  EXPECT_NEAR(c(0, 0), xx, kSixDigits * xx) << "xx, m^2";
  EXPECT_NEAR(c(0, 1), xy, kSixDigits * std::sqrt(xx * yy)) << "xy, m^2";
  EXPECT_NEAR(c(1, 0), xy, kSixDigits * std::sqrt(xx * yy)) << "yx, m^2";
  EXPECT_NEAR(c(1, 1), yy, kSixDigits * yy) << "yy, m^2";
  EXPECT_TRUE(c.row(2).isZero(0) && c.col(2).isZero(0)) << "no heading was measured";
}

TEST(LeastSquaresHardCases, T1) {
  const Fix fix = solve({ranged(0, 0, std::sqrt(2.0)), ranged(4, 0, std::sqrt(10.0)), ranged(0, 3, std::sqrt(5.0))});
  expect_at(fix, FixVerdict::kOk, 1, 1, bound_m(4, 1.1));
  expect_covariance(*fix.covariance, 6.363636e-5, 9.090909e-6, 7.272727e-5);
  EXPECT_EQ(fix.used, 3);
  EXPECT_EQ(fix.degrees_of_freedom, 1);
}

TEST(LeastSquaresHardCases, T2LandmarksInLineGiveBothAnswers) {
  const Fix fix =
      solve({ranged(0, 0, 1.80277563773199), ranged(2, 0, 1.80277563773199), ranged(5, 0, 4.27200187265877)});
  const double side = fix.position_m && fix.position_m->y() < 0 ? -1 : 1;
  // The ranges are given with 15 digits.
  constexpr double kGiven_m = 1e-14;
  expect_at(fix, FixVerdict::kAmbiguous, 1, side * 1.5, kGiven_m);
  ASSERT_TRUE(fix.other_position_m && fix.other_covariance);
  EXPECT_NEAR(fix.other_position_m->x(), 1, kGiven_m);
  EXPECT_NEAR(fix.other_position_m->y(), -side * 1.5, kGiven_m);
  // The exact value, with rows u = (1, 1.5) / 1.803, (-1, 1.5) / 1.803, (-4, 1.5) / 4.272: (sum u u^T)^-1 * 1e-4.
  const double a = 2 / 3.25 + 16 / 18.25;
  const double b = -6 / 18.25;
  const double c = 2 * 2.25 / 3.25 + 2.25 / 18.25;
  const double d = a * c - b * b;
  expect_covariance(*fix.covariance, 1e-4 * c / d, side * -1e-4 * b / d, 1e-4 * a / d);
  expect_covariance(*fix.other_covariance, 1e-4 * c / d, side * 1e-4 * b / d, 1e-4 * a / d);
  EXPECT_NEAR(fix.covariance->operator()(0, 0), 7.0402e-5, 1e-9);  // the list's own value
  EXPECT_NEAR(fix.covariance->operator()(1, 1), 6.9664e-5, 1e-9);
}

TEST(LeastSquaresHardCases, T3OnTheLandmarksLineIsWeakAcross) {
  const Fix fix = solve({ranged(0, 0, 1), ranged(2, 0, 1), ranged(5, 0, 4)});
  expect_at(fix, FixVerdict::kWeak, 1, 0, bound_m(5, 1));
  ASSERT_TRUE(fix.unseen_direction);
  EXPECT_NEAR(std::abs(fix.unseen_direction->y()), 1, 4 * kEps);
  EXPECT_NEAR(fix.unseen_direction->x(), 0, 4 * kEps);
  EXPECT_EQ(fix.unseen_direction->z(), 0);
  // The singular value is sqrt(3) = 1.732: three rows observe x.
  EXPECT_NEAR(fix.covariance->operator()(0, 0), 1e-4 / 3, 1e-4 * kSixDigits);
  // Along y chi-squared is k y^4: the ranges are short by y^2 / 2d, of which x compensates its share, 1 / 24 y^2, three
  // times. The mean square of exp(-k y^4 / 2) is sqrt(2 / k) Gamma(3/4) / Gamma(1/4). The coefficient of y^6 is a few
  // hundredths of y^2: 1 %.
  const double k = (0.25 + 0.25 + 1 / 64.0 - 3 / 576.0) / 1e-4;
  const double y2 = std::sqrt(2 / k) * std::tgamma(0.75) / std::tgamma(0.25);
  EXPECT_NEAR(fix.covariance->operator()(1, 1), y2, 0.02 * y2);
  EXPECT_EQ(fix.degrees_of_freedom, 2) << "three ranges, one direction seen";
}

TEST(LeastSquaresHardCases, T3WithNoiseIsWeakOrBothAnswers) {
  // Chi-squared is 1 at |y| = 0.118: range errors of one sigma may move the roots to any |y| below about that.
  for (const auto& [a, b, c] : {std::tuple{0.01, -0.007, 0.003}, {-0.01, -0.008, -0.012}, {0.012, 0.009, 0.011}}) {
    const Fix fix = solve({ranged(0, 0, 1 + a), ranged(2, 0, 1 + b), ranged(5, 0, 4 + c)});
    ASSERT_EQ(fix.verdict, FixVerdict::kWeak) << to_string(fix.verdict);
    EXPECT_NEAR(fix.position_m->x(), 1, 3 * std::sqrt(1e-4 / 3)) << "three sigma";
    EXPECT_NEAR(std::abs(fix.unseen_direction->y()), 1, 1e-3);
  }
}

TEST(LeastSquaresHardCases, T5TwoLandmarksInOnePlaceGiveBothAnswers) {
  const Fix fix = solve({ranged(0, 0, std::sqrt(2.0)), ranged(0, 0, std::sqrt(2.0)), ranged(4, 0, std::sqrt(10.0))});
  const double side = fix.position_m && fix.position_m->y() < 0 ? -1 : 1;
  expect_at(fix, FixVerdict::kAmbiguous, 1, side, bound_m(4, 1.5));
  ASSERT_TRUE(fix.other_position_m);
  EXPECT_NEAR(fix.other_position_m->x(), 1, bound_m(4, 1.5));
  EXPECT_NEAR(fix.other_position_m->y(), -side, bound_m(4, 1.5));
}

TEST(LeastSquaresHardCases, T7TangentFromOutside) {
  // 0.1 + 0.2 - 0.3 is 5.55e-17 in doubles.
  expect_at(solve({ranged(0, 0, 0.1), ranged(0.3, 0, 0.2)}), FixVerdict::kWeak, 0.1, 0, bound_m(0.3, 1));
  // A third circle that crosses both at a good angle determines the place.
  expect_at(solve({ranged(0, 0, 0.1), ranged(0.3, 0, 0.2), ranged(0.1, 0.4, 0.4)}), FixVerdict::kOk, 0.1, 0,
            bound_m(0.4, 1));
}

TEST(LeastSquaresHardCases, T8TangentFromInside) {
  expect_at(solve({ranged(0, 0, 3), ranged(1, 0, 2)}), FixVerdict::kWeak, 3, 0, bound_m(3, 1));
  expect_at(solve({ranged(0, 0, 3), ranged(1, 0, 2), ranged(3, 4, 4)}), FixVerdict::kOk, 3, 0, bound_m(4, 1));
}

TEST(LeastSquaresHardCases, T9) {
  const Fix fix = solve({ranged(69, 0, 69), ranged(0, 50, 50), ranged(0, 80, 80)});
  expect_at(fix, FixVerdict::kOk, 0, 0, bound_m(80, 1));
  expect_covariance(*fix.covariance, 1e-4, 0, 0.5e-4);
}

TEST(LeastSquaresHardCases, T12TwoLandmarksGiveBothAnswersAndNotTheSaddle) {
  const Fix fix = solve({ranged(-1, 0, std::numbers::sqrt2), ranged(1, 0, std::numbers::sqrt2)});
  const double side = fix.position_m && fix.position_m->y() < 0 ? -1 : 1;
  expect_at(fix, FixVerdict::kAmbiguous, 0, side, bound_m(1.5, 1));
  ASSERT_TRUE(fix.other_position_m);
  EXPECT_NEAR(fix.other_position_m->y(), -side, bound_m(1.5, 1));
  expect_covariance(*fix.covariance, 1e-4, 0, 1e-4);
}

TEST(LeastSquaresHardCases, T13RoundedRangesAreNotRefused) {
  const Fix fix = solve({ranged(2, 2, 1), ranged(3, 3, 1), ranged(1, 4, 1.4142)});
  expect_at(fix, FixVerdict::kOk, 1.9999952049942517, 3.0000047950057483, bound_m(4, 1));
  constexpr double kThreeDigits_m = 0.005e-6;
  EXPECT_NEAR(std::sqrt(fix.chi_squared / 3) * 0.01, 5.54e-6, kThreeDigits_m) << "rms residual, m";
}

TEST(LeastSquaresHardCases, T14AFarOriginCostsNothing) {
  const Eigen::Vector2d truth(1.37, 1.21);
  for (const double o : {0.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8}) {
    const Eigen::Vector2d shift(o, o);
    std::vector<LandmarkMeasurement> measurements;
    for (const Eigen::Vector2d& l : {Eigen::Vector2d(0.1, 0.7), {4.3, 0.2}, {0.9, 3.1}}) {
      // The landmark's place is rounded to the doubles at `o`; the range is to the rounded place.
      const Eigen::Vector2d shifted = l + shift;
      measurements.push_back(ranged(shifted.x(), shifted.y(), ((shifted - shift) - truth).norm()));
    }
    const double spacing_m = std::nextafter(o + 2, kInf) - (o + 2);
    expect_at(solve(measurements), FixVerdict::kOk, o + truth.x(), o + truth.y(), bound_m(4, 1.5) + spacing_m);
  }
}

TEST(LeastSquaresHardCases, T16OnALandmark) {
  const Fix fix = solve({ranged(0, 0, 0), ranged(4, 0, 4), ranged(0, 3, 3)});
  expect_at(fix, FixVerdict::kOk, 0, 0, bound_m(4, 1));
  expect_covariance(*fix.covariance, 1e-4, 0, 1e-4);
}

TEST(LeastSquaresHardCases, T16NearerToALandmarkThanThePositionIsKnown) {
  const Fix fix = solve({ranged(0.003, 0.002, std::hypot(0.003, 0.002)), ranged(4, 0, 4), ranged(0, 3, 3)});
  expect_at(fix, FixVerdict::kOk, 0, 0, bound_m(4, 1));
  expect_covariance(*fix.covariance, 1e-4, 0, 1e-4);
}

TEST(LeastSquaresHardCases, T17WhatIsNoMeasurementIsLeftOutAndCounted) {
  LandmarkMeasurement no_number = ranged(1, 1, 1);
  no_number.range_m.reset();
  LandmarkMeasurement bad_bearing = ranged(1, 1, 1);
  bad_bearing.bearing_rad = kNaN;
  LandmarkMeasurement not_positive = ranged(5, 1, 1);
  not_positive.bearing_rad = 0.3;
  not_positive.covariance << 1, 2, 2, 1;
  const Fix fix = solve({ranged(9, 9, kNaN), ranged(0, 0, std::sqrt(2.0)), ranged(9, 9, -1), ranged(8, 1, kInf),
                         ranged(4, 0, std::sqrt(10.0)), ranged(kNaN, 7, 1), no_number, bad_bearing, not_positive,
                         ranged(7, 7, 1, 0), ranged(7, 7, 1, kNaN), ranged(0, 3, std::sqrt(5.0))});
  expect_at(fix, FixVerdict::kOk, 1, 1, bound_m(4, 1.1));
  EXPECT_EQ(fix.used, 3);
  EXPECT_EQ(fix.unusable, 9);
}

/// The list counts from one: r3 is the range to (0, 3), as the list's plain least-squares answer shows.
std::vector<LandmarkMeasurement> t18(double sigma_m) {
  return {ranged(0, 0, std::sqrt(2.0), sigma_m), ranged(4, 0, std::sqrt(10.0), sigma_m),
          ranged(0, 3, std::sqrt(5.0) + 1, sigma_m), ranged(4, 3, std::sqrt(13.0), sigma_m)};
}

TEST(LeastSquaresHardCases, T18NamesTheOutlier) {
  const Fix fix = solve(t18(0.01));
  expect_at(fix, FixVerdict::kOk, 1, 1, bound_m(5, 1.1));
  EXPECT_EQ(fix.outliers, std::vector<int>{2});
  EXPECT_EQ(fix.used, 3);
}

TEST(LeastSquaresHardCases, T18WhicheverLandmarkItIs) {
  for (int wrong = 0; wrong < 4; ++wrong) {
    std::vector<LandmarkMeasurement> m = {ranged(0, 0, std::sqrt(2.0)), ranged(4, 0, std::sqrt(10.0)),
                                          ranged(0, 3, std::sqrt(5.0)), ranged(4, 3, std::sqrt(13.0))};
    *m[std::size_t(wrong)].range_m += 1;
    const Fix fix = solve(m);
    expect_at(fix, FixVerdict::kOk, 1, 1, bound_m(5, 1.1));
    EXPECT_EQ(fix.outliers, std::vector<int>{wrong});
  }
}

TEST(LeastSquaresHardCases, T18BelievedIsPlainLeastSquares) {
  // With this sigma 1 m is noise. The minimum is the same for every common sigma.
  const Fix fix = solve(t18(0.2));
  constexpr double kFiveDigits_m = 0.5e-5;
  ASSERT_TRUE(fix.position_m) << to_string(fix.verdict);
  EXPECT_NEAR(fix.position_m->x(), 1.25657, kFiveDigits_m);
  EXPECT_NEAR(fix.position_m->y(), 0.30788, kFiveDigits_m);
  EXPECT_TRUE(fix.outliers.empty());
}

TEST(LeastSquaresHardCases, T22MaximumOfLikelihood) {
  const double sigma_m = 0.05;  // the planted errors are noise; the minimum is the same for every common sigma
  const Fix fix = solve({ranged(0, 0, std::sqrt(2.0) + 0.05, sigma_m), ranged(4, 0, std::sqrt(10.0) - 0.03, sigma_m),
                         ranged(0, 3, std::sqrt(5.0) + 0.04, sigma_m)});
  // The residuals affect the condition too, but their curvature, 0.05 / 1.4, is small.
  expect_at(fix, FixVerdict::kOk, 1.0511549201562855, 1.0003042872465623, bound_m(4, 1.2));
  constexpr double kFourDigits_m = 0.5e-5;
  EXPECT_NEAR(std::sqrt(fix.chi_squared / 3) * sigma_m, 0.01631, kFourDigits_m) << "rms residual, m";
}

TEST(LeastSquaresHardCases, NoCoordinateGivesANumberThatIsNone) {
  for (const double s : {1e150, 1e-150, 1e-300, 1e300, 3e-310}) {
    const Fix fix = solve({ranged(0, 0, s * std::sqrt(2.0), 0.01 * s), ranged(4 * s, 0, s * std::sqrt(10.0), 0.01 * s),
                           ranged(0, 3 * s, s * std::sqrt(5.0), 0.01 * s)});
    if (s < 1e-200 || s > 1e200) {  // a double cannot hold 1e-4 s^2: no sigma, no measurement
      EXPECT_EQ(fix.verdict, FixVerdict::kTooFew) << "scale " << s;
      EXPECT_EQ(fix.unusable, 3);
      continue;
    }
    expect_at(fix, FixVerdict::kOk, s, s, bound_m(4 * s, 1.1));
    EXPECT_NEAR(fix.covariance->operator()(0, 0) / s / s, 6.363636e-5, 6.4e-5 * kSixDigits) << "scale " << s;
  }
}

TEST(LeastSquaresHardCases, ASigmaBelowRoundingIsThatOfRounding) {
  // Ranges of metres with a stated sigma of 1e-30 m, and of 1e150 m with one of 1 cm: the rounding of doubles is no
  // contradiction.
  for (const double s : {1.0, 1e150}) {
    const double sigma_m = s == 1 ? 1e-30 : 0.01;
    const Fix fix =
        solve({ranged(0, 0, s * std::sqrt(2.0), sigma_m), ranged(4 * s, 0, s * std::sqrt(10.0), sigma_m),
               ranged(0, 3 * s, s * std::sqrt(5.0), sigma_m), ranged(4 * s, 3 * s, s * std::sqrt(13.0), sigma_m)});
    expect_at(fix, FixVerdict::kOk, s, s, bound_m(5 * s, 1.1));
  }
}

TEST(LeastSquaresHardCases, DenormalsAreNumbers) {
  const double d = 4.9e-324;
  const Fix fix = solve(
      {ranged(d, 0, std::sqrt(2.0)), ranged(4, -d, std::sqrt(10.0)), ranged(0, 3, std::sqrt(5.0)), ranged(1, 1, d)});
  expect_at(fix, FixVerdict::kOk, 1, 1, bound_m(4, 1.1));
}

TEST(LeastSquaresHardCases, CirclesThatJustMissAreTheMiddleOfTheGapHoweverTheMapIsTurned) {
  // The gap is 0.1 m and sigma is 0.1 m: each circle is off by half of the gap. Across, x has a standard deviation of
  // sigma / sqrt(2). Along, chi-squared about the middle is 2 (0.05 + t^2 / 4)^2 / sigma^2; the sum below gives its
  // mean square.
  double weights = 0;
  double sum = 0;
  for (double t = -3; t < 3; t += 1e-3) {
    const double e = 1.95 - std::hypot(2, t);
    const double weight = std::exp(-(2 * e * e - 2 * 0.05 * 0.05) / 0.01 / 2);
    weights += weight;
    sum += weight * t * t;
  }
  for (double turn = 0; turn < 6.3; turn += 0.1) {
    const Eigen::Vector2d along(std::cos(turn), std::sin(turn));
    const Fix fix = solve({ranged(0, 0, 1.95, 0.1), ranged(4 * along.x(), 4 * along.y(), 1.95, 0.1)});
    // The curvature of chi-squared is 5 per m^2 along the gap's middle and 200 across it: condition 40.
    expect_at(fix, FixVerdict::kWeak, 2 * along.x(), 2 * along.y(), bound_m(4, 40));
    ASSERT_TRUE(fix.unseen_direction);
    // The error is the square root of a rounding, since chi-squared has no slope in the middle.
    EXPECT_NEAR(fix.unseen_direction->head<2>().dot(along), 0, std::sqrt(kEps));
    const Eigen::Matrix2d c = fix.covariance->topLeftCorner<2, 2>();
    EXPECT_NEAR(along.dot(c * along), 0.005, 0.005 * 1e-6) << turn;
    const Eigen::Vector2d across(-along.y(), along.x());
    // Steps are a quarter of the width, on the floor of the valley, from which the straight line differs slightly.
    EXPECT_NEAR(across.dot(c * across), sum / weights, 0.05 * sum / weights) << turn;
  }
}

TEST(LeastSquaresHardCases, CirclesThatMissAreJudgedBySigma) {
  for (const double sigma_m : {250.0, 300.0, 400.0}) {  // a gap of 456: 1.8 to 1.1 sigmas of a difference
    const Fix fix = solve({ranged(810, 960, 22, sigma_m), ranged(810, 1440, 2, sigma_m)});
    expect_at(fix, FixVerdict::kWeak, 810, 1210, bound_m(1440, 1));
    EXPECT_NEAR((*fix.covariance)(1, 1), sigma_m * sigma_m / 2, 1e-6 * sigma_m * sigma_m);
  }
  // 4.6 sigmas of a difference: 4e-6.
  EXPECT_EQ(solve({ranged(810, 960, 22, 70), ranged(810, 1440, 2, 70)}).verdict, FixVerdict::kContradictory);
}

TEST(LeastSquaresHardCases, AWeakCovarianceIsRightAcrossAndAlong) {
  const double sigma_m = 0.03;
  const Fix fix = solve({ranged(0, 0, 1044.030650891055, sigma_m), ranged(5, 0, 1039.2425126023281, sigma_m),
                         ranged(0, 5, 1042.604910788358, sigma_m)});
  ASSERT_EQ(fix.verdict, FixVerdict::kWeak);
  // The covariance by hand is (sum u u^T)^-1 sigma^2.
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& l : {Eigen::Vector2d(0, 0), {5, 0}, {0, 5}}) {
    const Eigen::Vector2d u = (l - Eigen::Vector2d(1000, 300)).normalized();
    information += u * u.transpose() / (sigma_m * sigma_m);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> stated(fix.covariance->topLeftCorner<2, 2>());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> right(information.inverse());
  for (int k = 0; k < 2; ++k) {
    // The sum has steps of a quarter of the width, and the rows have a condition of 300.
    EXPECT_NEAR(std::sqrt(stated.eigenvalues()[k]), std::sqrt(right.eigenvalues()[k]),
                0.01 * std::sqrt(right.eigenvalues()[k]));
  }
  EXPECT_NEAR(std::sqrt(stated.eigenvalues()[0]), 0.017, 0.001);
  EXPECT_NEAR(std::sqrt(stated.eigenvalues()[1]), 6.78, 0.05);
  EXPECT_NEAR(std::abs(fix.unseen_direction->head<2>().dot(stated.eigenvectors().col(1))), 1, 1e-6);
}

TEST(LeastSquaresHardCases, OneWildMeasurementIsAnOutlier) {
  for (const double wild_m : {1e12, 1e150, 1e300}) {
    std::vector<LandmarkMeasurement> m = {ranged(0, 0, std::sqrt(2.0)), ranged(4, 0, std::sqrt(10.0)),
                                          ranged(0, 3, std::sqrt(5.0)), ranged(4, 3, wild_m)};
    const Fix range = solve(m);
    expect_at(range, FixVerdict::kOk, 1, 1, bound_m(5, 1.1));
    EXPECT_EQ(range.outliers, std::vector<int>{3}) << wild_m;
    m[3] = ranged(wild_m, -wild_m, 2);
    const Fix landmark = solve(m);
    expect_at(landmark, FixVerdict::kOk, 1, 1, bound_m(5, 1.1));
    EXPECT_EQ(landmark.outliers, std::vector<int>{3}) << wild_m;
  }
}

TEST(LeastSquaresHardCases, ABeaconFarAwayIsNoOutlier) {
  std::vector<LandmarkMeasurement> m = {ranged(0, 0, std::sqrt(2.0)), ranged(4, 0, std::sqrt(10.0)),
                                        ranged(0, 3, std::sqrt(5.0)), ranged(1e12, 0, 1e12 - 1)};
  const Fix fix = solve(m);
  EXPECT_TRUE(fix.outliers.empty());
}

TEST(LeastSquaresHardCases, TooFew) {
  EXPECT_EQ(solve({}).verdict, FixVerdict::kTooFew);
  EXPECT_EQ(solve({ranged(0, 0, 1)}).verdict, FixVerdict::kTooFew);
  const Fix one_place = solve({ranged(1, 1, 1), ranged(1, 1, 1), ranged(1, 1, 1)});
  EXPECT_EQ(one_place.verdict, FixVerdict::kTooFew);
  EXPECT_FALSE(one_place.position_m);
  LandmarkMeasurement one{.landmark_m = {1, 2}, .range_m = 2, .bearing_rad = 0.3};
  EXPECT_EQ(solve({one}).verdict, FixVerdict::kTooFew);
  EXPECT_EQ(solve({one, one, one}).verdict, FixVerdict::kTooFew) << "one place, however often";
}

TEST(LeastSquaresHardCases, CirclesThatMissEachOtherContradict) {
  const Fix fix = solve({ranged(0, 0, 1), ranged(3, 0, 1.5)});
  EXPECT_EQ(fix.verdict, FixVerdict::kContradictory) << to_string(fix.verdict);
  EXPECT_FALSE(fix.position_m);
}

}  // namespace
}  // namespace twocone::localisation
