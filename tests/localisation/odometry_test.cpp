// SPDX-License-Identifier: Apache-2.0
#include "localisation/odometry.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/special_doubles.h"

namespace twocone::localisation {
namespace {

using twocone::testing_support::kEps;

struct ArcCase {
  double turn_rate_radps;
  double heading_rad;
  double dx_m;
  double dy_m;
};
void PrintTo(const ArcCase& c, std::ostream* os) { *os << "w" << c.turn_rate_radps; }

/// 50-digit values: 1 m/s for 0.1 s (hard cases, "Motion").
class OdometryArc : public testing::TestWithParam<ArcCase> {};

TEST_P(OdometryArc, AgreesWithFiftyDigits) {
  const ArcCase& c = GetParam();
  // The wheels have a radius of 1 m and are 1 m apart, so angles are metres. D = 0.1 m, T = w dt.
  Odometry odometry({1, 1}, {0, 0, c.heading_rad});
  odometry.update(0, 0);
  const double turn_rad = c.turn_rate_radps * 0.1;
  const Pose pose = odometry.update(0.1 - turn_rad / 2, 0.1 + turn_rad / 2);
  // The turn is right - left, a difference of numbers near 0.1 that were rounded to 2^-56: each ulp of it moves the end
  // by 0.1 * ulp / 2. Some four roundings of lengths of 0.1 m are added.
  constexpr double kTolerance_m = 0.1 * 8 * kEps;
  EXPECT_NEAR(pose.x_m, c.dx_m, kTolerance_m);
  EXPECT_NEAR(pose.y_m, c.dy_m, kTolerance_m);
}

INSTANTIATE_TEST_SUITE_P(HardCases, OdometryArc,
                         testing::Values(ArcCase{0, 0, 0.1, 0},
                                         ArcCase{1e-15, 1, 0.054030230586813971, 0.084147098480789658},
                                         ArcCase{1e-12, 1, 0.054030230586809767, 0.084147098480792357},
                                         ArcCase{1e-9, 1, 0.05403023058260662, 0.084147098483491167},
                                         ArcCase{1e-6, 1, 0.054030226379458961, 0.084147101182301044},
                                         ArcCase{1e-3, 1, 0.054026023141843057, 0.084149799852071581},
                                         ArcCase{1, 1, 0.049736375253538836, 0.086706184442562335}));

TEST(Odometry, AFullCircleComesBack) {
  Odometry odometry({1, 1}, {0, 0, 0});
  odometry.update(0, 0);
  const Pose pose = odometry.update(1 - std::numbers::pi, 1 + std::numbers::pi);  // D = 1 m, T = 2 pi
  EXPECT_NEAR(pose.x_m, 0, 4 * kEps);
  EXPECT_NEAR(pose.y_m, 0, 4 * kEps);
  EXPECT_NEAR(pose.heading_rad, 0, 4 * kEps);
}

TEST(Odometry, StaysExactOverARun) {
  // 450 steps of 1 m/s and 0.5 rad/s at 15 Hz make an arc of radius 2 m over 15 rad.
  Odometry odometry({0.05, 0.3}, {0, 0, 0});
  odometry.update(0, 0);
  Pose pose;
  for (int i = 1; i <= 450; ++i) {
    const double t = i / 15.0;
    pose = odometry.update((1 - 0.5 * 0.15) * t / 0.05, (1 + 0.5 * 0.15) * t / 0.05);
  }
  constexpr double kTolerance_m = 1e-13;  // the figure of the hard cases: 450 roundings of numbers below 4
  EXPECT_NEAR(pose.x_m, 2 * std::sin(15.0), kTolerance_m);
  EXPECT_NEAR(pose.y_m, 2 * (1 - std::cos(15.0)), kTolerance_m);
}

TEST(Odometry, ReadingTwiceAsOftenChangesNothing) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> turn(-3, 3);
  for (int i = 0; i < 1000; ++i) {
    const double left = turn(random);
    const double right = turn(random);
    Odometry once({0.05, 0.3}, {0.3, -0.2, 0.7});
    Odometry twice({0.05, 0.3}, {0.3, -0.2, 0.7});
    once.update(0, 0);
    twice.update(0, 0);
    twice.update(left / 3, right / 3);
    const Pose a = once.update(left, right);
    const Pose b = twice.update(left, right);
    constexpr double kTolerance = 16 * kEps;  // a dozen roundings of values below 1
    EXPECT_NEAR(a.x_m, b.x_m, kTolerance) << "case " << i;
    EXPECT_NEAR(a.y_m, b.y_m, kTolerance) << "case " << i;
    EXPECT_NEAR(a.heading_rad, b.heading_rad, kTolerance) << "case " << i;
  }
}

TEST(Odometry, TheFirstReadingOnlySetsTheZero) {
  Odometry odometry({0.05, 0.3}, {1, 2, 0.5});
  EXPECT_EQ(odometry.update(123.4, -56.7), (Pose{1, 2, 0.5}));
}

TEST(Odometry, RefusesWhatIsNoWheelAndNoAngle) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Odometry({0, 0.3}, {}), std::invalid_argument);
  EXPECT_THROW(Odometry({0.05, -0.3}, {}), std::invalid_argument);
  EXPECT_THROW(Odometry({0.05, nan}, {}), std::invalid_argument);
  EXPECT_THROW(Odometry({0.05, 0.3}, {nan, 0, 0}), std::invalid_argument);
  Odometry odometry({0.05, 0.3}, {});
  EXPECT_THROW(odometry.update(nan, 0), std::invalid_argument);
}

TEST(WrapAngle, HardCases) {
  const double above_pi = std::nextafter(std::numbers::pi, 4);
  EXPECT_EQ(wrap_angle_rad(std::numbers::pi), std::numbers::pi);
  EXPECT_EQ(wrap_angle_rad(0.3), 0.3);
  EXPECT_NEAR(wrap_angle_rad(above_pi), -3.1415926535897929, 2 * kEps);
  EXPECT_NEAR(wrap_angle_rad(1e6), -0.35756416708573504, kEps);
  EXPECT_NEAR(wrap_angle_rad((-179.0 - 179.0) * std::numbers::pi / 180), 2 * std::numbers::pi / 180, 4 * kEps);
  EXPECT_TRUE(std::isnan(wrap_angle_rad(std::numeric_limits<double>::infinity())));
}

// Catches NaN from wheels without separation.
TEST(DriveArc, NeedsASeparation) {
  for (const double separation_m : {0.0, -0.3, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW((void)drive_arc({}, 0.1, 0.2, separation_m), std::invalid_argument) << separation_m;
  }
}

}  // namespace
}  // namespace twocone::localisation
