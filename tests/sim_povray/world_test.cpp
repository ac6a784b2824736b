// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/wheel.h"
#include "tests/sim_povray/wheels_of_body.h"
#include "tests/support/special_doubles.h"

namespace twocone::sim_povray {
namespace {

using std::chrono::nanoseconds;
using twocone::testing_support::kEps;

RobotBody body() {
  return {.start = {0.2, -0.3, 0.4},
          .wheels = {.separation_m = 0.27, .radius_m = 0.043},
          .command_timeout = nanoseconds(500'000'000)};
}

/// A world with one robot in it.
struct Alone {
  Alone(const RobotBody& b, double rate_hz) : world(PlaceSettings{}), robot(*world.add_robot(b)) {
    world.set_rate(rate_hz);
  }
  void command(const WheelSpeeds& speeds) { world.command(robot, speeds); }
  void step() { world.step(); }
  [[nodiscard]] const Pose2& pose() const { return world.pose(robot); }
  [[nodiscard]] const World::Turned& turned() const { return world.turned(robot); }

  World world;
  World::RobotId robot;
};

double between(const Pose2& a, const Pose2& b) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m); }

// Catches a clock that sums rounded periods: 1/15 s is not a whole number of nanoseconds.
TEST(World, TheTimeOfEachStepIsRoundedSeparately) {
  World world = world_of(PlaceSettings{});
  EXPECT_EQ(world.now(), nanoseconds(0));
  world.step();
  EXPECT_EQ(world.now(), nanoseconds(66'666'667));
  world.step();
  EXPECT_EQ(world.now(), nanoseconds(133'333'333));
  while (world.step_number() < 450) world.step();
  EXPECT_EQ(world.now(), nanoseconds(30'000'000'000));
}

TEST(World, ANewRateAppliesFromThePresentStepOn) {
  World world = world_of(PlaceSettings{});
  for (int i = 0; i < 3; ++i) world.step();
  world.set_rate(40);
  world.step();
  EXPECT_EQ(world.now(), nanoseconds(200'000'000 + 25'000'000));
  EXPECT_EQ(world.step_number(), 4U);
}

TEST(World, StandsWithoutACommand) {
  Alone a(body(), 15);
  for (int i = 0; i < 5; ++i) a.step();
  EXPECT_EQ(a.pose(), body().start);
  EXPECT_EQ(a.turned().left_rad, 0);
}

TEST(World, DrivesTheArcOfItsWheels) {
  Alone a(body(), 4);
  a.command({2.3, 3.1});
  a.step();
  const Pose2 expected = advance(body().start, body_speeds({2.3 * 0.043, 3.1 * 0.043}, 0.27), 0.25);
  // The operations and their order are the same except for one product.
  EXPECT_NEAR(a.pose().x_m, expected.x_m, 4 * kEps);
  EXPECT_NEAR(a.pose().y_m, expected.y_m, 4 * kEps);
  EXPECT_NEAR(a.pose().heading_rad, expected.heading_rad, 4 * kEps);
  EXPECT_DOUBLE_EQ(a.turned().left_rad, 2.3 * 0.25);
  EXPECT_DOUBLE_EQ(a.turned().right_rad, 3.1 * 0.25);
}

// A run must stay byte-equal to the first version, which had one robot, no contact and no lag. Its operations are
// repeated here. Catches every "harmless" change of their order, and a body or a wall that changes a path without
// contact.
TEST(World, ARobotThatTouchesNothingKeepsItsBytes) {
  RobotBody b = body();
  b.seed = 7;
  b.wheels.slip = 0.02;
  for (const double radius_m : {0.0, 0.2}) {
    b.radius_m = radius_m;
    PlaceSettings place{.walls = Bounds{-30, 30, -30, 30}};
    World world = world_of(place);
    const World::RobotId robot = *world.add_robot(b);

    Slip left(0.02, b.wheels.slip_correlation_s, engine_for(7, Purpose::kLeftSlip));
    Slip right(0.02, b.wheels.slip_correlation_s, engine_for(7, Purpose::kRightSlip));
    Pose2 pose = b.start;
    World::Turned turned;
    nanoseconds now{0};
    nanoseconds commanded_at{0};
    WheelSpeeds speeds;
    for (int i = 0; i < 200; ++i) {
      if (i % 11 < 2) {  // so that the dead-man time ends within the eighth step after it
        speeds = {2 + 0.01 * i, 2.5 - 0.02 * i};
        world.command(robot, speeds);
        commanded_at = now;
      }
      world.step();
      const nanoseconds next(std::llround(double(i + 1) * 1e9 / 15));
      const auto alive = std::max(b.command_timeout - (now - commanded_at), nanoseconds(0));
      const double dt_s = std::chrono::duration<double>(std::min(alive, next - now)).count();
      if (dt_s > 0) {
        pose = advance(pose,
                       body_speeds({speeds.left_radps * 0.043 * (1 + left.value()),
                                    speeds.right_radps * 0.043 * (1 + right.value())},
                                   0.27),
                       dt_s);
        turned.left_rad += speeds.left_radps * dt_s;
        turned.right_rad += speeds.right_radps * dt_s;
      }
      left.advance(std::chrono::duration<double>(next - now).count());
      right.advance(std::chrono::duration<double>(next - now).count());
      now = next;
      ASSERT_EQ(world.pose(robot), pose) << "step " << i << ", body " << radius_m << " m";
      ASSERT_EQ(world.turned(robot).left_rad, turned.left_rad) << "step " << i;
      ASSERT_EQ(world.turned(robot).right_rad, turned.right_rad) << "step " << i;
    }
  }
}

// Catches a dead-man rule that acts only at the next step: 0.5 s end within the eighth period of 1/15 s.
TEST(World, WheelsStopExactlyWhenTheCommandIsTooOld) {
  Alone a(body(), 15);
  a.command({1.7, 1.7});
  for (int i = 0; i < 7; ++i) a.step();
  EXPECT_NEAR(a.turned().left_rad, 1.7 * 7 / 15, 1.7e-9) << "a nanosecond of rounding in the period";
  a.step();
  constexpr double kExact_rad = 1.7 * 0.5;
  EXPECT_NEAR(a.turned().left_rad, kExact_rad, 8 * 8 * kEps);
  // Half a period ago the wheels already stood.
  EXPECT_EQ(a.world.pose_before(a.robot, nanoseconds(33'333'333)), a.pose());
  EXPECT_NE(a.world.pose_before(a.robot, nanoseconds(33'333'335)), a.pose());
  for (int i = 0; i < 20; ++i) a.step();
  EXPECT_NEAR(a.turned().left_rad, kExact_rad, 8 * 8 * kEps);
  EXPECT_NEAR(between(a.pose(), body().start), kExact_rad * 0.043, 8 * 8 * kEps);
}

TEST(World, ACommandLastsToTheEndOfItsTimeAndNoLonger) {
  RobotBody b = body();
  b.command_timeout = nanoseconds(250'000'000);
  Alone a(b, 4);  // the dead-man time ends at a step of the world
  a.command({1, 1});
  a.step();
  EXPECT_DOUBLE_EQ(a.turned().left_rad, 0.25);
  a.step();
  EXPECT_DOUBLE_EQ(a.turned().left_rad, 0.25);
  a.command({1, 1});
  a.step();
  EXPECT_DOUBLE_EQ(a.turned().left_rad, 0.5);
}

TEST(World, EachCommandRestartsTheDeadManTime) {
  Alone a(body(), 4);
  for (int i = 0; i < 10; ++i) {
    a.command({1, -1});
    a.step();
  }
  EXPECT_NEAR(a.turned().left_rad, 2.5, 20 * kEps);
  EXPECT_NEAR(a.turned().right_rad, -2.5, 20 * kEps);
}

TEST(World, TheLongestTimeoutDoesNotOverflow) {
  RobotBody b = body();
  b.command_timeout = nanoseconds::max();
  Alone a(b, 1);
  a.step();
  a.command({1, 1});
  a.step();
  EXPECT_DOUBLE_EQ(a.turned().left_rad, 1);
}

TEST(World, HaltStopsAtOnce) {
  Alone a(body(), 10);
  a.command({1, 1});
  a.world.halt(a.robot);
  a.step();
  EXPECT_EQ(a.pose(), body().start);
}

// Slip is the difference between the way over the floor and the wheel's rotation. The encoder does not measure it.
TEST(World, SlipMovesTheBodyAndNotTheEncoder) {
  RobotBody b = body();
  Alone exact(b, 15);
  b.wheels.slip = 0.05;
  Alone slipping(b, 15);
  for (int i = 0; i < 100; ++i) {
    exact.command({2, 2.5});
    slipping.command({2, 2.5});
    exact.step();
    slipping.step();
  }
  EXPECT_EQ(slipping.turned().left_rad, exact.turned().left_rad);
  EXPECT_EQ(slipping.turned().right_rad, exact.turned().right_rad);
  EXPECT_GT(between(slipping.pose(), exact.pose()), 1e-3);
}

// Catches one slip for both wheels: a robot that is commanded straight would drive straight.
TEST(World, EachWheelSlipsIndependently) {
  RobotBody b = body();
  b.wheels.slip = 0.05;
  Alone a(b, 15);
  for (int i = 0; i < 30; ++i) {
    a.command({2, 2});
    a.step();
  }
  EXPECT_GT(std::abs(a.pose().heading_rad - b.start.heading_rad), 1e-3);
}

TEST(World, TheSeedDeterminesThePath) {
  RobotBody b = body();
  b.wheels.slip = 0.02;
  const auto end_of_path = [&b](std::uint64_t seed) {
    b.seed = seed;
    Alone a(b, 15);
    for (int i = 0; i < 60; ++i) {
      a.command({2, 2.5});
      a.step();
    }
    return a.pose();
  };
  EXPECT_EQ(end_of_path(7), end_of_path(7));
  EXPECT_NE(end_of_path(7), end_of_path(8));
  EXPECT_NE(end_of_path(7), end_of_path(7 + (std::uint64_t(1) << 32))) << "the seed's upper half counts too";
}

// ---- earlier poses

// The image of a moving camera consists of poses within the step, which must lie on the arc that was driven.
TEST(World, PosesWithinTheLastStepLieOnItsArc) {
  Alone a(body(), 4);
  EXPECT_EQ(a.world.pose_before(a.robot, nanoseconds(0)), body().start) << "before the first step";
  a.command({2.3, 9.1});
  a.step();
  EXPECT_EQ(a.world.pose_before(a.robot, nanoseconds(0)), a.pose());
  EXPECT_EQ(a.world.pose_before(a.robot, nanoseconds(250'000'000)), body().start);
  const Pose2 expected = advance(body().start, body_speeds({2.3 * 0.043, 9.1 * 0.043}, 0.27), 0.18);
  const Pose2 there = a.world.pose_before(a.robot, nanoseconds(70'000'000));
  EXPECT_NEAR(there.x_m, expected.x_m, 4 * kEps);
  EXPECT_NEAR(there.y_m, expected.y_m, 4 * kEps);
  EXPECT_NEAR(there.heading_rad, expected.heading_rad, 4 * kEps);
}

// A late stamp requires older poses. They must equal the poses at their time, at the steps and between them, and reach
// back kMaxStampLate_s beyond the last step.
TEST(World, PosesOfEarlierStepsAreKept) {
  RobotBody plain = body();
  plain.wheels.slip = 0.03;
  plain.begin = Pose2{-0.4, 0.1, -2};
  RobotBody lags = plain;
  lags.wheels.lag_s = 0.17;
  for (const auto& [name, robot] : {std::pair("plain", plain), std::pair("lagging", lags)}) {
    Alone a(robot, 14.3);
    std::vector<std::pair<nanoseconds, Pose2>> history;
    nanoseconds last{0};
    for (int i = 0; i < 25; ++i) {
      const nanoseconds step = a.world.now() - last;
      last = a.world.now();
      for (const nanoseconds before : {step / 3, nanoseconds(0)}) {
        history.emplace_back(a.world.now() - before, a.world.pose_before(a.robot, before));
      }
      int compared = 0;
      for (const auto& [time, pose] : history) {
        const nanoseconds before = a.world.now() - time;
        if (before > nanoseconds(500'000'000) + step) continue;
        ASSERT_EQ(a.world.pose_before(a.robot, before), pose) << name << ", step " << i << ", " << before.count();
        ++compared;
      }
      // 0.5 s are 7.15 steps: these and the last one, each with two poses.
      if (i > 8) {
        EXPECT_GE(compared, 2 * 8) << name << ", step " << i;
      }
      if (i < 7) {
        EXPECT_EQ(a.world.pose_before(a.robot, nanoseconds(500'000'000)), *robot.begin) << "before time 0";
      }
      a.command({2.3 + 0.3 * i, 5.1 - 0.4 * i});
      a.step();
    }
    EXPECT_GT(between(history.front().second, history.back().second), 0.1) << "this test requires a robot that moves";
  }
}

// ---- many robots

TEST(World, ARobotsPathDoesNotDependOnOtherRobots) {
  RobotBody b = body();
  b.wheels.slip = 0.03;
  b.radius_m = 0.2;
  const auto end_of = [](World& world, World::RobotId robot) {
    world.set_rate(15);
    drive(world, robot, {2, 2.5}, 40);
    return world.pose(robot);
  };
  World alone{PlaceSettings{}};
  const Pose2 expected = end_of(alone, *alone.add_robot(b));

  RobotBody other = b;
  other.name = "robot.2";
  other.start = {5, 5, 0};
  World first{PlaceSettings{}};
  const World::RobotId robot = *first.add_robot(b);
  ASSERT_TRUE(first.add_robot(other));
  EXPECT_EQ(end_of(first, robot), expected);
  World second{PlaceSettings{}};
  ASSERT_TRUE(second.add_robot(other));
  EXPECT_EQ(end_of(second, *second.add_robot(b)), expected);
}

TEST(World, ARobotThatJoinsLaterStartsAtItsStart) {
  Alone a(body(), 15);
  for (int i = 0; i < 9; ++i) a.step();
  const World::RobotId late = *a.world.add_robot(body());
  EXPECT_NE(late, a.robot);
  EXPECT_EQ(a.world.pose(late), body().start);
  EXPECT_EQ(a.world.pose_before(late, nanoseconds(50'000'000)), body().start);
  EXPECT_EQ(a.world.turned(late).left_rad, 0);
}

// The next run must see the same as in a new world: the same times, identifiers and random draws.
TEST(World, AResetWorldRepeatsItself) {
  RobotBody b = body();
  b.wheels.slip = 0.03;
  PlaceSettings place{.moving = {{"cart", {{0, 1}, {1, 1}}, 0.3, true, 0.1}}};
  World world = world_of(place);
  const auto run = [&world, &b] {
    const World::RobotId robot = *world.add_robot(b);
    drive(world, robot, {2, 2.5}, 40);
    return std::tuple(robot, world.now(), world.step_number(), world.pose(robot), world.moving_pose_before(0, {}));
  };
  const auto first = run();
  world.begin_anew();
  EXPECT_EQ(world.now(), nanoseconds(0));
  EXPECT_EQ(world.step_number(), 0U);
  EXPECT_EQ(world.moving_pose_before(0, {}), (Pose2{0, 1, 0}));
  EXPECT_EQ(run(), first);
}

// ---- lag

RobotBody lagging() {
  RobotBody b = body();
  b.wheels.lag_s = 0.17;
  return b;
}

// w = u (1 - e^(-t/lag)), so the angle is u (t - lag (1 - e^(-t/lag))). It is exact although the path consists of
// pieces.
TEST(Lag, AnglesAreThoseOfTheClosedForm) {
  Alone a(lagging(), 15);
  double time_s = 0;
  for (int i = 0; i < 30; ++i) {
    a.command({3, -1.1});
    a.step();
    time_s = std::chrono::duration<double>(a.world.now()).count();
    const double angle = time_s - 0.17 * (1 - std::exp(-time_s / 0.17));
    // Each step has a few roundings of angles below 6 rad.
    ASSERT_NEAR(a.turned().left_rad, 3 * angle, (i + 1) * 20 * kEps) << "step " << i;
    ASSERT_NEAR(a.turned().right_rad, -1.1 * angle, (i + 1) * 20 * kEps) << "step " << i;
  }
}

// Catches lag that begins only at a step of the world, and a dead-man time that stops the wheels abruptly.
TEST(Lag, WheelsRunOutAfterTheDeadManTime) {
  Alone a(lagging(), 15);
  a.command({3, 3});
  for (int i = 0; i < 8; ++i) a.step();
  EXPECT_GT(a.turned().left_rad, 3 * (0.5 - 0.17 * (1 - std::exp(-0.5 / 0.17))) + 0.01)
      << "the wheels still turn at 0.5 s";
  for (int i = 0; i < 200; ++i) a.step();
  // The total angle is u times the driven time: the end compensates the loss at the beginning.
  EXPECT_NEAR(a.turned().left_rad, 3 * 0.5, 1e-12);
  const Pose2 standing = a.pose();
  a.step();
  EXPECT_EQ(a.pose(), standing) << "the wheels must stop";
}

TEST(Lag, HaltLetsTheWheelsRunOut) {
  Alone a(lagging(), 10);
  a.command({3, 3});
  a.step();
  a.world.halt(a.robot);
  const double before_rad = a.turned().left_rad;
  const double speed_radps = 3 * (1 - std::exp(-0.1 / 0.17));
  a.step();
  EXPECT_NEAR(a.turned().left_rad - before_rad, speed_radps * 0.17 * (1 - std::exp(-0.1 / 0.17)), 20 * kEps);
}

/// Integrates x' = v cos h, y' = v sin h by fourth-order Runge-Kutta, with the wheels' closed form from standstill.
Pose2 fine_reference(const Pose2& start, const WheelSpeeds& u, double lag_s, double time_s, int steps) {
  const auto slope = [&](double t, double heading_rad) {
    const double w = 1 - std::exp(-t / lag_s);
    const BodySpeeds b = body_speeds({u.left_radps * w * 0.043, u.right_radps * w * 0.043}, 0.27);
    return std::array{b.speed_mps * std::cos(heading_rad), b.speed_mps * std::sin(heading_rad), b.turn_radps};
  };
  Pose2 p = start;
  const double h = time_s / steps;
  for (int i = 0; i < steps; ++i) {
    const double t = h * i;
    const auto k1 = slope(t, p.heading_rad);
    const auto k2 = slope(t + h / 2, p.heading_rad + h / 2 * k1[2]);
    const auto k3 = slope(t + h / 2, p.heading_rad + h / 2 * k2[2]);
    const auto k4 = slope(t + h, p.heading_rad + h * k3[2]);
    p.x_m += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]);
    p.y_m += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]);
    p.heading_rad += h / 6 * (k1[2] + 2 * k2[2] + 2 * k3[2] + k4[2]);
  }
  return p;
}

// Checks the bound that world.h states, for time constants far above, at and far below the length of the pieces.
TEST(Lag, ThePathAgreesWithAFineReferenceWithinTheStatedBound) {
  const WheelSpeeds u{4, 23};
  const BodySpeeds most = body_speeds({u.left_radps * 0.043, u.right_radps * 0.043}, 0.27);
  constexpr double kArc_s = 0.25e-3;
  const double bound_m = kArc_s * kArc_s / 2 * 2 * most.speed_mps * most.turn_radps;
  // Error of the reference: Simpson's rule on e^(-t/lag) with steps of a quarter of the shortest lag is wrong by
  // (1/4)^4 / 2880 of turn x lag, 3 rad/s x 1e-5 s.
  constexpr double kHeading_rad = 1e-10;
  for (const double lag_s : {0.17, 0.01, 0.25e-3, 1e-5}) {
    RobotBody b = body();
    b.wheels.lag_s = lag_s;
    Alone a(b, 4);
    a.command(u);
    a.step();
    const Pose2 expected = fine_reference(b.start, u, lag_s, 0.25, 100'000);
    EXPECT_LT(between(a.pose(), expected), bound_m) << "lag " << lag_s << " s";
    EXPECT_NEAR(wrap_angle(a.pose().heading_rad - expected.heading_rad), 0, kHeading_rad) << "lag " << lag_s << " s";
    // The bound also holds within the step.
    EXPECT_LT(between(a.world.pose_before(a.robot, nanoseconds(100'000'000)),
                      fine_reference(b.start, u, lag_s, 0.15, 100'000)),
              bound_m)
        << "lag " << lag_s << " s";
  }
}

TEST(Lag, ZeroLagHasNoEffect) {
  WheelCourse course{99, 2, 0.3, 0};
  EXPECT_EQ(course.turned_rad(0.2), 2 * 0.2);
  EXPECT_EQ(course.turned_rad(0.5), 2 * 0.3);
  EXPECT_EQ(course.speed_radps(0.2), 2);
  EXPECT_EQ(course.speed_radps(0.4), 0);
}

}  // namespace
}  // namespace twocone::sim_povray
