// SPDX-License-Identifier: Apache-2.0
// Hard cases by name, with answers from 50-digit arithmetic: trilateration (T), ranges from disparity (R), bearings
// near the tip (B4), motion, angles. Those of fix_by_triangle are in tests/localisation/paper_trilateration_test.cpp
// too.
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"
#include "localisation/paper_trilateration.h"
#include "tests/support/disparity_range.h"
#include "tests/support/special_doubles.h"
#include "vision/mirror_view.h"
#include "vision/triangulation.h"

namespace twocone {
namespace {

using localisation::Fix;
using localisation::FixVerdict;
using twocone::testing_support::kEps;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;
using vision::RangeVerdict;

constexpr double kSigma_m = 0.01;

struct Place {
  double x_m, y_m, range_m;
};

Fix fit(const std::vector<Place>& places) {
  std::vector<localisation::LandmarkMeasurement> measurements;
  for (const Place& p : places) {
    measurements.push_back(
        {{p.x_m, p.y_m}, p.range_m, std::nullopt, kSigma_m * kSigma_m * Eigen::Matrix2d::Identity()});
  }
  return localisation::fix_by_least_squares(measurements);
}

// Error for well-placed landmarks and lengths of a few metres: some ten roundings.
constexpr double kWell_m = 64 * kEps;
// Error along a direction that is observed only by its square: the root of a rounding of lengths of a few metres.
const double kRoot_m = std::sqrt(64 * kEps * 4);

void expect_at(const Fix& fix, FixVerdict verdict, double x_m, double y_m, double tolerance_m) {
  ASSERT_EQ(to_string(fix.verdict), to_string(verdict));
  ASSERT_TRUE(fix.position_m);
  EXPECT_NEAR(fix.position_m->x(), x_m, tolerance_m);
  EXPECT_NEAR(fix.position_m->y(), y_m, tolerance_m);
}

/// The covariance is given with six digits.
void expect_covariance(const std::optional<Eigen::Matrix3d>& c, double xx, double xy, double yy) {
  ASSERT_TRUE(c);
  constexpr double kStated = 1e-5;
  EXPECT_NEAR((*c)(0, 0), xx, kStated * xx);
  EXPECT_NEAR((*c)(0, 1), xy, kStated * xx);
  EXPECT_NEAR((*c)(1, 1), yy, kStated * yy);
}

const std::vector<Place> kT1 = {{0, 0, std::sqrt(2.0)}, {4, 0, std::sqrt(10.0)}, {0, 3, std::sqrt(5.0)}};

TEST(HardCases, T1WellPlaced) {
  const Fix fix = fit(kT1);
  expect_at(fix, FixVerdict::kOk, 1, 1, kWell_m);
  expect_covariance(fix.covariance, 6.36364e-5, 9.0909e-6, 7.27273e-5);
}

TEST(HardCases, T2InLineGivesBothAnswers) {
  const Fix fix = fit({{0, 0, 1.80277563773199}, {2, 0, 1.80277563773199}, {5, 0, 4.27200187265877}});
  ASSERT_EQ(fix.verdict, FixVerdict::kAmbiguous) << to_string(fix.verdict);
  // The ranges are given with 15 digits.
  constexpr double kGiven_m = 1e-13;
  const double side = fix.position_m->y() > 0 ? 1 : -1;
  EXPECT_NEAR(fix.position_m->x(), 1, kGiven_m);
  EXPECT_NEAR(fix.position_m->y(), side * 1.5, kGiven_m);
  EXPECT_NEAR(fix.other_position_m->x(), 1, kGiven_m);
  EXPECT_NEAR(fix.other_position_m->y(), -side * 1.5, kGiven_m);
  expect_covariance(fix.covariance, 7.0402e-5, side * 1.5350e-5, 6.9664e-5);
  expect_covariance(fix.other_covariance, 7.0402e-5, side * -1.5350e-5, 6.9664e-5);
}

TEST(HardCases, T3OnTheLandmarksLineOneDirectionIsNotSeen) {
  const Fix fix = fit({{0, 0, 1}, {2, 0, 1}, {5, 0, 4}});
  expect_at(fix, FixVerdict::kWeak, 1, 0, kRoot_m);
  ASSERT_TRUE(fix.unseen_direction);
  EXPECT_NEAR(std::abs(fix.unseen_direction->y()), 1, kRoot_m);
}

TEST(HardCases, T5TwoLandmarksInOnePlaceGiveBothAnswers) {
  const Fix fix = fit({{0, 0, std::sqrt(2.0)}, {0, 0, std::sqrt(2.0)}, {4, 0, std::sqrt(10.0)}});
  ASSERT_EQ(fix.verdict, FixVerdict::kAmbiguous) << to_string(fix.verdict);
  EXPECT_NEAR(fix.position_m->x(), 1, kWell_m);
  EXPECT_NEAR(std::abs(fix.position_m->y()), 1, kWell_m);
  EXPECT_NEAR(fix.position_m->y() + fix.other_position_m->y(), 0, kWell_m);
}

TEST(HardCases, T7TangentFromOutsideHasNoNaN) {
  expect_at(fit({{0, 0, 0.1}, {0.3, 0, 0.2}, {0.1, 0.4, 0.4}}), FixVerdict::kOk, 0.1, 0, kWell_m);
}

TEST(HardCases, T8TangentFromInside) {
  expect_at(fit({{0, 0, 3}, {1, 0, 2}, {3, 4, 4}}), FixVerdict::kOk, 3, 0, kWell_m);
}

TEST(HardCases, T9) {
  const Fix fix = fit({{69, 0, 69}, {0, 50, 50}, {0, 80, 80}});
  expect_at(fix, FixVerdict::kOk, 0, 0, 64 * kEps * 80);
  expect_covariance(fix.covariance, 1e-4, 0, 0.5e-4);
}

TEST(HardCases, T12TwoRangesGiveBothAnswersOrAreTooFew) {
  // The start (0, 0), where the gradient is 0, must lead to both answers like any other start, never to one of them by
  // chance.
  const Fix fix = fit({{-1, 0, std::numbers::sqrt2}, {1, 0, std::numbers::sqrt2}});
  ASSERT_EQ(fix.verdict, FixVerdict::kAmbiguous) << to_string(fix.verdict);
  EXPECT_NEAR(fix.position_m->x(), 0, kWell_m);
  EXPECT_NEAR(std::abs(fix.position_m->y()), 1, kWell_m);
  EXPECT_NEAR(fix.position_m->y() + fix.other_position_m->y(), 0, kWell_m);
}

TEST(HardCases, T13RoundedRangesAreNotRefused) {
  expect_at(fit({{2, 2, 1}, {3, 3, 1}, {1, 4, 1.4142}}), FixVerdict::kOk, 1.9999952049942517, 3.0000047950057483,
            kWell_m);
}

TEST(HardCases, T14AFarOriginCostsNothing) {
  for (const double o : {0.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8}) {
    std::vector<Place> places;
    for (const auto& [x, y] : {std::pair{0.1, 0.7}, {4.3, 0.2}, {0.9, 3.1}}) {
      const double far_x = x + o;
      const double far_y = y + o;
      places.push_back({far_x, far_y, std::hypot(far_x - o - 1.37, far_y - o - 1.21)});
    }
    const double spacing_m = std::nextafter(o + 2, kInf) - (o + 2);
    expect_at(fit(places), FixVerdict::kOk, o + 1.37, o + 1.21, kWell_m + spacing_m);
  }
}

TEST(HardCases, T16OnALandmarkThatRangeHasNoGradient) {
  const Fix fix = fit({{0, 0, 0}, {4, 0, 4}, {0, 3, 3}});
  expect_at(fix, FixVerdict::kOk, 0, 0, kWell_m);
  expect_covariance(fix.covariance, 1e-4, 0, 1e-4);
}

TEST(HardCases, T17WhatIsNoRangeIsLeftOutAndCounted) {
  std::vector<Place> places = kT1;
  places.insert(places.begin() + 1, {{9, 9, -1}, {8, 8, kNaN}, {7, 7, kInf}});
  const Fix fix = fit(places);
  expect_at(fix, FixVerdict::kOk, 1, 1, kWell_m);
  EXPECT_EQ(fix.unusable, 3);
  EXPECT_EQ(fix.used, 3);
}

TEST(HardCases, T18TheOutlierIsNamed) {
  std::vector<Place> places = kT1;
  places[2].range_m += 1;
  places.push_back({4, 3, std::sqrt(13.0)});
  const Fix fix = fit(places);
  expect_at(fix, FixVerdict::kOk, 1, 1, kWell_m);
  EXPECT_EQ(fix.outliers, std::vector<int>{2});
}

TEST(HardCases, T22MaximumLikelihoodAndTheCentroid) {
  std::vector<Place> places = kT1;
  places[0].range_m += 0.05;
  places[1].range_m -= 0.03;
  places[2].range_m += 0.04;
  expect_at(fit(places), FixVerdict::kOk, 1.0511549201562855, 1.0003042872465623, kWell_m);
  std::vector<localisation::LandmarkRange> ranges;
  for (const Place& p : places) ranges.push_back({{p.x_m, p.y_m}, p.range_m});
  expect_at(localisation::fix_by_triangle(ranges), FixVerdict::kOk, 1.0456678374588409, 0.99612158170507930, kWell_m);
}

TEST(HardCases, AFarOriginDoesNotHideWhichSideTheThirdLandmarkStandsOn) {
  // The landmarks are 5 nm off one line, 1e6 m from the origin: the errors of the two sides differ by less than an eps
  // of the coordinates.
  constexpr double kFar_m = 1048576;
  constexpr double kOff_m = 0x1p-27;
  std::vector<localisation::LandmarkRange> ranges;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {2.0, 0.0}, {5.0, kOff_m}}) {
    ranges.push_back({{kFar_m + x, kFar_m + y}, std::hypot(x - 1, y - 1.5)});
  }
  // The error of the true side is rounding, 1e-15, and that of the other side 5 nm; each moves the answer's height by
  // 1 / sine of the angle between the directions.
  expect_at(localisation::fix_by_triangle(ranges), FixVerdict::kOk, kFar_m + 1, kFar_m + 1.5, 4 * kEps * kFar_m);
}

// --- ranges from disparity, which hard-cases.md gives in millimetres

constexpr double kPixelSigma = 0.1;
const vision::DisparityGeometry kLab{708, 0.3, 0.12, 236};  // v s = 212400 px mm, d = 120 mm

vision::InverseRange range_of(double disparity_px) {
  return vision::range_from_disparity(disparity_px, kPixelSigma, kLab);
}

TEST(HardCases, R1) {
  const vision::InverseRange r = range_of(81.06870229007633);
  ASSERT_EQ(r.verdict, RangeVerdict::kOk);
  EXPECT_NEAR(*r.range_m, 2.5, 8 * kEps * 2.62);
  EXPECT_NEAR(*r.sigma_range_m, 2.62 * 2.62 * kPixelSigma / 212.4, 1e-15);
}

TEST(HardCases, R2ToR4AreBeyondTheLimitWithTheirInverse) {
  for (const double disparity : {0.0, -0.3, 1e-9}) {
    const vision::InverseRange r = range_of(disparity);
    EXPECT_EQ(r.verdict, RangeVerdict::kBeyondLimit) << disparity << " px";
    EXPECT_FALSE(r.range_m) << disparity << " px";
    EXPECT_NEAR(r.inverse_per_m, disparity / 212.4, 2 * kEps * std::abs(disparity / 212.4)) << disparity << " px";
    EXPECT_NEAR(r.sigma_inverse_per_m, kPixelSigma / 212.4, 1e-18) << disparity << " px";
  }
  EXPECT_NEAR(range_of(-0.3).inverse_per_m, -1.41e-3, 0.005e-3);  // as stated, per mm
}

TEST(HardCases, R6PastTheRimIsImpossible) {
  for (const double disparity : {2000.0, 236.1, kInf, kNaN}) {
    const vision::InverseRange r = range_of(disparity);
    EXPECT_EQ(r.verdict, RangeVerdict::kImpossible) << disparity << " px";
    EXPECT_FALSE(r.range_m) << disparity << " px";
  }
  EXPECT_NEAR(*range_of(236).range_m, 0.78, 1e-15);  // s (d + R) / R - d
}

TEST(HardCases, R8TheErrorBudgetOfOneErrorAt2500mm) {
  const double disparity = 81.06870229007633;
  vision::DisparityGeometry other = kLab;
  other.focal_length_px *= 1.01;
  EXPECT_NEAR(*vision::range_from_disparity(disparity, kPixelSigma, other).range_m - 2.5, 0.026, 0.0005);
  other.focal_length_px = 3 * 237;  // r_m wrong by 1 px: v = (d / R + 1) r_m
  EXPECT_NEAR(*vision::range_from_disparity(disparity, kPixelSigma, other).range_m - 2.5, 0.011, 0.0005);
  EXPECT_NEAR(*range_of(disparity - 1).range_m - 2.5, 0.032, 0.001);  // a centre wrong by 1 px
}

// --- B4

TEST(HardCases, B4TowardsTheTipTheBearingIsLost) {
  const vision::MirrorView view({.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
                                 .lens_height_m = 0.25,
                                 .centre_px = {319.5, 239.5},
                                 .rim_radius_px = 236});
  EXPECT_FALSE(view.back_project({319.5, 239.5}));
  constexpr double kTurn_rad = 0.7;
  for (const double radius_px : {100.0, 1.0, 1e-3, 1e-6, 1e-9}) {
    const double shown = view.bearing_rad({radius_px * std::cos(kTurn_rad), radius_px * std::sin(kTurn_rad)});
    EXPECT_NEAR(shown, kTurn_rad, 4 * kEps) << radius_px;
    // A tangential error of 0.1 px turns it by the arc tangent of 0.1 px / radius.
    const Eigen::Vector2d moved(radius_px * std::cos(kTurn_rad) - 0.1 * std::sin(kTurn_rad),
                                radius_px * std::sin(kTurn_rad) + 0.1 * std::cos(kTurn_rad));
    EXPECT_NEAR(view.bearing_rad(moved) - kTurn_rad, std::atan(0.1 / radius_px), 8 * kEps) << radius_px;
  }
}

// --- motion

struct ArcCase {
  double turn_rate_radps, heading_rad, dx_m, dy_m;
};

TEST(HardCases, MotionTable) {
  for (const ArcCase& c : {ArcCase{0, 0, 0.1, 0}, ArcCase{1e-15, 1, 0.054030230586813971, 0.084147098480789658},
                           ArcCase{1e-12, 1, 0.054030230586809767, 0.084147098480792357},
                           ArcCase{1e-9, 1, 0.05403023058260662, 0.084147098483491167},
                           ArcCase{1e-6, 1, 0.054030226379458961, 0.084147101182301044},
                           ArcCase{1e-3, 1, 0.054026023141843057, 0.084149799852071581},
                           ArcCase{1, 1, 0.049736375253538836, 0.086706184442562335}}) {
    localisation::Odometry odometry({1, 1}, {0, 0, c.heading_rad});
    odometry.update(0, 0);
    const double turn = c.turn_rate_radps * 0.1;
    const localisation::Pose& pose = odometry.update(0.1 - turn / 2, 0.1 + turn / 2);
    constexpr double kTolerance_m = 0.1 * 8 * kEps;
    EXPECT_NEAR(pose.x_m, c.dx_m, kTolerance_m) << c.turn_rate_radps << " rad/s";
    EXPECT_NEAR(pose.y_m, c.dy_m, kTolerance_m) << c.turn_rate_radps << " rad/s";
  }
}

TEST(HardCases, MotionOfNoWheelIsRefused) {
  EXPECT_THROW(localisation::Odometry({0.05, 0}, {}), std::invalid_argument);
  EXPECT_THROW(localisation::Odometry({0.05, -0.3}, {}), std::invalid_argument);
  localisation::Odometry odometry({0.05, 0.3}, {});
  EXPECT_THROW(odometry.update(0, kNaN), std::invalid_argument);
}

// --- angles

TEST(HardCases, Angles) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_EQ(localisation::wrap_angle_rad(kPi), kPi);
  EXPECT_NEAR(localisation::wrap_angle_rad(std::nextafter(kPi, 4)), -3.1415926535897929, 2 * kEps);
  EXPECT_NEAR(localisation::wrap_angle_rad(1e6), -0.35756416708573504, kEps);
  EXPECT_NEAR(localisation::wrap_angle_rad((-179.0 - 179.0) * kPi / 180), 2 * kPi / 180, 4 * kEps);
}

}  // namespace
}  // namespace twocone
