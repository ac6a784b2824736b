// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/motion.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_of.h"
#include "tests/support/special_doubles.h"

namespace twocone::sim_povray {
namespace {

using twocone::testing_support::error_of;
using twocone::testing_support::kEps;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

struct ArcCase {
  double heading_rad;
  double turn_radps;
  double dx_m;
  double dy_m;
};

// The expected values were computed with 50 digits, for v = 1 m/s during 0.1 s. Catches the textbook form with v/w,
// which is NaN at 0 and wrong by 0.1 m at 1e-15.
TEST(Advance, HardCases) {
  // Four roundings (distance, factor of the chord, angle, cos or sin) of at most eps/2 each, relative to 0.1 m; doubled
  // for the library's sin and cos.
  constexpr double kArcError_m = 4 * kEps * 0.1;
  for (const ArcCase& c : {ArcCase{0, 0, 0.1, 0},
                           {1, 1e-15, 0.054030230586813971, 0.084147098480789658},
                           {1, 1e-12, 0.054030230586809767, 0.084147098480792357},
                           {1, 1e-9, 0.05403023058260662, 0.084147098483491167},
                           {1, 1e-6, 0.054030226379458961, 0.084147101182301044},
                           {1, 1e-3, 0.054026023141843057, 0.084149799852071581},
                           {1, 1, 0.049736375253538836, 0.086706184442562335}}) {
    const Pose2 to = advance({0, 0, c.heading_rad}, {1, c.turn_radps}, 0.1);
    EXPECT_NEAR(to.x_m, c.dx_m, kArcError_m) << "w = " << c.turn_radps << " rad/s";
    EXPECT_NEAR(to.y_m, c.dy_m, kArcError_m) << "w = " << c.turn_radps << " rad/s";
    EXPECT_NEAR(to.heading_rad, c.heading_rad + c.turn_radps * 0.1, 2 * kEps) << "w = " << c.turn_radps << " rad/s";
  }
}

TEST(Advance, AFullCircleEndsAtItsStart) {
  const Pose2 to = advance({0, 0, 0}, {1, 2 * std::numbers::pi}, 1);
  EXPECT_NEAR(to.x_m, 0, kEps);
  EXPECT_NEAR(to.y_m, 0, kEps);
  EXPECT_NEAR(to.heading_rad, 0, 2 * std::numbers::pi * kEps);
}

// Catches an approximate integrator: the error of Euler is 6e-2 m here, that of second-order Runge-Kutta 1.7e-4 m.
TEST(Advance, FourHundredAndFiftyStepsStayOnTheCircle) {
  constexpr double kTurn_radps = 0.5;
  constexpr int kSteps = 450;
  Pose2 pose{0, 0, 0.3};
  for (int i = 0; i < kSteps; ++i) pose = advance(pose, {1, kTurn_radps}, 1.0 / 15);
  // Each step rounds a coordinate of at most 4 m, and a heading of at most pi. The error of the heading turns the
  // remaining circle, whose diameter is 4 m.
  constexpr double kTolerance_m = kSteps * (4 + 4 * std::numbers::pi) * kEps / 2;
  const double end_rad = 0.3 + kTurn_radps * kSteps / 15;
  EXPECT_NEAR(pose.x_m, (std::sin(end_rad) - std::sin(0.3)) / kTurn_radps, kTolerance_m);
  EXPECT_NEAR(pose.y_m, (std::cos(0.3) - std::cos(end_rad)) / kTurn_radps, kTolerance_m);
}

// An arc driven in k pieces ends where the whole arc ends. Catches a step that is not exact for its length.
TEST(Advance, PiecesEndWhereTheWholeEnds) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    const Pose2 from{3 * any(engine), 3 * any(engine), std::numbers::pi * any(engine)};
    const BodySpeeds speeds{2 * any(engine), 5 * any(engine)};
    const double dt_s = 0.05 + std::abs(any(engine));
    const int pieces = 2 + int(seed % 40);
    Pose2 there = from;
    for (int i = 0; i < pieces; ++i) there = advance(there, speeds, dt_s / pieces);
    const Pose2 whole = advance(from, speeds, dt_s);
    // Coordinates are below 6 m. The rounding of a heading (below 2 pi) turns the remaining way, which is below 2.1 m.
    const double tolerance_m = (pieces + 1) * (6 + 2.1 * 2 * std::numbers::pi) * kEps;
    EXPECT_NEAR(there.x_m, whole.x_m, tolerance_m) << "case " << seed;
    EXPECT_NEAR(there.y_m, whole.y_m, tolerance_m) << "case " << seed;
    EXPECT_NEAR(wrap_angle(there.heading_rad - whole.heading_rad), 0, (pieces + 1) * 2 * std::numbers::pi * kEps)
        << "case " << seed;
  }
}

TEST(Advance, NamesEveryBadArgument) {
  const std::string complaint = error_of<std::invalid_argument>([] { (void)advance({0, kNaN, 0}, {kInf, 0.5}, 0); });
  EXPECT_THAT(complaint, testing::AllOf(testing::HasSubstr("y_m is nan m"), testing::HasSubstr("speed_mps is inf m/s"),
                                        testing::HasSubstr("dt_s is 0 s, must be > 0")));
  EXPECT_THAT(complaint, testing::Not(testing::HasSubstr("turn_radps")));
  EXPECT_THROW((void)advance({}, {1, 1}, -0.1), std::invalid_argument);
  EXPECT_THROW((void)advance({}, {1, 1}, kNaN), std::invalid_argument);
  EXPECT_THROW((void)advance({}, {1, kNaN}, 1), std::invalid_argument);
}

TEST(BodySpeedsOfWheels, MeanAndDifference) {
  const BodySpeeds speeds = body_speeds({0.31, 0.47}, 0.27);
  EXPECT_DOUBLE_EQ(speeds.speed_mps, 0.39);
  EXPECT_NEAR(speeds.turn_radps, 0.16 / 0.27, 4 * kEps);
  EXPECT_GT(speeds.turn_radps, 0) << "a faster right wheel turns counter-clockwise";
}

TEST(BodySpeedsOfWheels, NamesEveryBadArgument) {
  EXPECT_THROW((void)body_speeds({1, 1}, 0), std::invalid_argument);
  EXPECT_THROW((void)body_speeds({1, 1}, -0.3), std::invalid_argument);
  EXPECT_THROW((void)body_speeds({kNaN, 1}, 0.3), std::invalid_argument);
  EXPECT_THROW((void)body_speeds({1, kInf}, 0.3), std::invalid_argument);
}

TEST(WrapAngle, Table) {
  EXPECT_EQ(wrap_angle(std::numbers::pi), std::numbers::pi);
  EXPECT_EQ(wrap_angle(0), 0);
  EXPECT_EQ(wrap_angle(-1.25), -1.25);
  EXPECT_EQ(wrap_angle(std::nextafter(std::numbers::pi, 4)), -3.1415926535897929);
  // The library's sin, cos and atan2 are correct within one ulp, and the angle is about 0.36.
  EXPECT_NEAR(wrap_angle(1e6), -0.35756416708573504, 4 * kEps);
  constexpr double kDegree = std::numbers::pi / 180;
  EXPECT_NEAR(wrap_angle(-179 * kDegree - 179 * kDegree), 2 * kDegree, 8 * kEps);
  EXPECT_THROW((void)wrap_angle(kNaN), std::invalid_argument);
  EXPECT_THROW((void)wrap_angle(kInf), std::invalid_argument);
}

TEST(WrapAngle, KeepsTheDirection) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> any(-50, 50);
  for (int i = 0; i < 10000; ++i) {
    const double angle_rad = any(engine);
    const double wrapped_rad = wrap_angle(angle_rad);
    ASSERT_LE(std::abs(wrapped_rad), std::numbers::pi) << angle_rad;
    // The input itself is only exact to half an ulp of 64.
    ASSERT_NEAR(std::remainder(angle_rad - wrapped_rad, 2 * std::numbers::pi), 0, 64 * kEps) << angle_rad;
  }
}

TEST(MotionBetween, IsTheIdentityAtTheStart) {
  const Pose2 pose{0.1, -0.7, 2.9};
  const FloorMotion motion = motion_between(pose, pose);
  EXPECT_EQ(motion.cos_turn, 1);
  EXPECT_EQ(motion.sin_turn, 0);
  EXPECT_EQ(motion.x_m, 0);
  EXPECT_EQ(motion.y_m, 0);
}

TEST(MotionBetween, CarriesPointsOfTheRobot) {
  const Pose2 start{0.31, -0.47, 0.83};
  const Pose2 now{-1.2, 0.6, -2.1};
  const FloorMotion m = motion_between(start, now);
  // A point 0.4 m ahead of and 0.15 m left of the robot.
  const auto on = [](const Pose2& p) {
    return std::pair(p.x_m + 0.4 * std::cos(p.heading_rad) - 0.15 * std::sin(p.heading_rad),
                     p.y_m + 0.4 * std::sin(p.heading_rad) + 0.15 * std::cos(p.heading_rad));
  };
  const auto [x, y] = on(start);
  const auto [moved_x, moved_y] = on(now);
  // A dozen roundings of numbers below 2 m.
  constexpr double kTolerance_m = 12 * 2 * kEps;
  EXPECT_NEAR(m.cos_turn * x - m.sin_turn * y + m.x_m, moved_x, kTolerance_m);
  EXPECT_NEAR(m.sin_turn * x + m.cos_turn * y + m.y_m, moved_y, kTolerance_m);
}

}  // namespace
}  // namespace twocone::sim_povray
