// SPDX-License-Identifier: Apache-2.0
// Contact without physics: a body stops where its path first touches something, and leaves it on command.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "drivers/sim_povray/world/world.h"
#include "tests/sim_povray/wheels_of_body.h"

namespace twocone::sim_povray {
namespace {

using std::chrono::nanoseconds;

// A body stops at a distance of at most kTouch_m from the object that it touches. It never stops inside the object,
// except for this rounding of coordinates below 4 m.
constexpr double kRounding_m = 32 * std::numeric_limits<double>::epsilon();

Outline box(double min_x_m, double max_x_m, double min_y_m, double max_y_m) {
  return {{min_x_m, min_y_m}, {max_x_m, min_y_m}, {max_x_m, max_y_m}, {min_x_m, max_y_m}};
}

TEST(Contact, AWallStopsTheBodyAndItsWheels) {
  PlaceSettings place{.walls = Bounds{-1, 1.5, -2, 2}};
  World world = world_of(place);
  const auto robot = *world.add_robot(body_at({0, 0, 0}));
  EXPECT_EQ(world.contact(robot), "");
  drive(world, robot, wheels(0.5), 60);
  EXPECT_EQ(world.contact(robot), "wall");
  EXPECT_LE(world.pose(robot).x_m + kRadius_m, 1.5 + kRounding_m);
  EXPECT_GE(world.pose(robot).x_m + kRadius_m, 1.5 - kTouch_m);
  // The encoders report the distance that the body really moved.
  EXPECT_NEAR(world.turned(robot).left_rad * kWheel_m, world.pose(robot).x_m, 60 * kRounding_m);
}

TEST(Contact, EachWallStopsIt) {
  PlaceSettings place{.walls = Bounds{-1.1, 1.2, -1.3, 1.4}};
  for (const double heading_rad : {0.0, std::numbers::pi / 2, std::numbers::pi, -std::numbers::pi / 2}) {
    World world = world_of(place);
    const auto robot = *world.add_robot(body_at({0, 0, heading_rad}));
    drive(world, robot, wheels(0.5), 60);
    EXPECT_EQ(world.contact(robot), "wall");
    const Pose2& p = world.pose(robot);
    const double room_m = std::min({p.x_m + 1.1, 1.2 - p.x_m, p.y_m + 1.3, 1.4 - p.y_m});
    EXPECT_NEAR(room_m, kRadius_m, kTouch_m + kRounding_m) << heading_rad;
  }
}

TEST(Contact, ALandmarkStopsItWhereTheCirclesTouch) {
  PlaceSettings place{.solids = {{"landmark red", Disc{{1.1, 0.13}, 0.31}}}};
  World world = world_of(place);
  const auto robot = *world.add_robot(body_at({0, 0, 0}));
  drive(world, robot, wheels(0.7), 60);
  EXPECT_EQ(world.contact(robot), "landmark red");
  EXPECT_NEAR(world.pose(robot).x_m, 1.1 - std::sqrt(0.51 * 0.51 - 0.13 * 0.13), 2 * kTouch_m);
}

// Catches a polygon taken as its convex hull: the bay of the U is free.
TEST(Contact, ABodyEntersTheBayOfAConcaveOutline) {
  PlaceSettings place{
      .solids = {{"obstacle 1", Outline{{1, -1}, {3, -1}, {3, 1}, {1, 1}, {1, 0.5}, {2, 0.5}, {2, -0.5}, {1, -0.5}}}}};
  World world = world_of(place);
  const auto inside = *world.add_robot(body_at({0, 0, 0}));
  drive(world, inside, wheels(0.8), 60);
  EXPECT_EQ(world.contact(inside), "obstacle 1");
  EXPECT_NEAR(world.pose(inside).x_m, 2 - kRadius_m, kTouch_m + kRounding_m);

  World corner = world_of(place);
  const auto at_corner = *corner.add_robot(body_at({0, 0.4, 0}));
  drive(corner, at_corner, wheels(0.8), 60);
  EXPECT_NEAR(corner.pose(at_corner).x_m, 1 - std::sqrt(0.04 - 0.01), 2 * kTouch_m) << "at its corner";
}

// Catches a search for contact at the end of a step only: at 5 m/s and 4 Hz a step is 1.25 m long.
TEST(Contact, NothingTunnelsThroughAThinPanel) {
  PlaceSettings place{.solids = {{"panel", box(0.9, 0.902, -3, 3)}}};
  World world = world_of(place, 4);
  const auto robot = *world.add_robot(body_at({0, 0, 0}));
  drive(world, robot, wheels(5), 3);
  EXPECT_EQ(world.contact(robot), "panel");
  EXPECT_NEAR(world.pose(robot).x_m, 0.9 - kRadius_m, kTouch_m + kRounding_m);
}

// A body with a radius of 1 mm at 100 m/s, along an arc, with and without lag.
TEST(Contact, NotEvenATinyFastBodyOnAnArcTunnels) {
  for (const double lag_s : {0.0, 0.05}) {
    PlaceSettings place{.solids = {{"panel", box(0.9, 0.902, -3000, 3000)}}};
    World world = world_of(place, 4);
    RobotBody b = body_at({0, 0, 0.3});
    b.radius_m = 0.001;
    b.wheels.lag_s = lag_s;
    const auto robot = *world.add_robot(b);
    drive(world, robot, wheels(100, -0.2), 3);
    EXPECT_EQ(world.contact(robot), "panel");
    EXPECT_NEAR(world.pose(robot).x_m, 0.9 - 0.001, kTouch_m + kRounding_m);
  }
}

// Compares the search with a slow one. Along random arcs among random solids, the body stops at the first sample that
// overlaps, plus or minus one sample, and nowhere else.
TEST(Contact, StopsWhereASlowSearchFindsTheFirstOverlap) {
  std::mt19937_64 engine(20);
  std::uniform_real_distribution<double> any(-1, 1);
  int stopped = 0;
  for (int n = 0; n < 150; ++n) {
    PlaceSettings place{.walls = Bounds{-2.5, 2.5, -2.5, 2.5}};
    for (int i = 0; i < 4; ++i) {
      const FloorPoint at{2.3 * any(engine), 2.3 * any(engine)};
      if (i % 2 == 0) {
        place.solids.push_back({"landmark", Disc{at, 0.05 + 0.2 * std::abs(any(engine))}});
      } else {
        place.solids.push_back({"wedge", Outline{at,
                                                 {at.x_m + 0.6 * any(engine), at.y_m + 0.6 * any(engine)},
                                                 {at.x_m + 0.6 * any(engine), at.y_m + 0.6 * any(engine)}}});
      }
    }
    World world = world_of(place, 0.5);
    const Pose2 start{any(engine), any(engine), std::numbers::pi * any(engine)};
    RobotBody b = body_at(start);
    b.command_timeout = std::chrono::seconds(10);
    const auto robot = world.add_robot(b);
    if (!robot) continue;
    const double speed_mps = 2 * any(engine);
    const double turn_radps = 3 * any(engine);
    world.command(*robot, wheels(speed_mps, turn_radps));
    world.step();

    const Surroundings around(place);
    const auto gap_m = [&](const Pose2& p) {
      double least_m = std::numeric_limits<double>::infinity();
      for (const Part& part : around.parts()) {
        least_m = std::min(least_m, facing(part, {p.x_m, p.y_m}).distance_m - kRadius_m);
      }
      return least_m;
    };
    constexpr int kSamples = 4000;
    double first_s = 2;
    for (int i = 1; i <= kSamples; ++i) {
      const double t_s = 2.0 * i / kSamples;
      if (gap_m(advance(start, {speed_mps, turn_radps}, t_s)) >= 0) continue;
      first_s = t_s;
      break;
    }
    const double gone_s = (world.turned(*robot).left_rad + world.turned(*robot).right_rad) / 2 * kWheel_m / speed_mps;
    EXPECT_GE(gap_m(world.pose(*robot)), -kRounding_m) << "case " << n;
    if (world.contact(*robot).empty()) {
      EXPECT_NEAR(gone_s, 2, 1e-9) << "case " << n;
      EXPECT_EQ(first_s, 2) << "case " << n;
    } else {
      ++stopped;
      // Only the exact search finds a short touch between two samples.
      EXPECT_LE(gone_s, first_s + 1e-9) << "case " << n;
      EXPECT_LE(gap_m(world.pose(*robot)), kTouch_m) << "case " << n;
    }
  }
  EXPECT_GT(stopped, 30) << "both kinds of cases must occur";
}

TEST(Contact, ARobotLeavesAWallBackwards) {
  PlaceSettings place{.walls = Bounds{-1, 1, -1, 1}};
  World world = world_of(place);
  const auto robot = *world.add_robot(body_at({0, 0, 0.3}));
  drive(world, robot, wheels(0.5), 60);
  const Pose2 there = world.pose(robot);
  ASSERT_EQ(world.contact(robot), "wall");
  drive(world, robot, wheels(0.5), 5);
  EXPECT_EQ(world.pose(robot), there) << "pressed against the wall, it stays";
  drive(world, robot, wheels(-0.5), 1);
  EXPECT_EQ(world.contact(robot), "");
  EXPECT_NEAR(std::hypot(world.pose(robot).x_m - there.x_m, world.pose(robot).y_m - there.y_m), 0.5 / 15, 1e-9);
}

// Slip makes a turn on the spot a very tight arc, which half of the time leads into the wall. That must not hold the
// robot.
TEST(Contact, ARobotAtAWallTurnsOnTheSpotAndDrivesOff) {
  PlaceSettings place{.walls = Bounds{-1, 1, -1, 1}};
  for (const std::uint64_t seed : {0, 1, 2, 3, 4}) {
    const double slip = seed == 0 ? 0 : 0.05;
    World world = world_of(place);
    RobotBody b = body_at({0, 0, 0.3});
    b.wheels.slip = slip;
    b.seed = seed;
    const auto robot = *world.add_robot(b);
    drive(world, robot, wheels(0.5), 60);
    ASSERT_EQ(world.contact(robot), "wall");
    const double before_rad = world.turned(robot).right_rad;
    const double heading_rad = world.pose(robot).heading_rad;
    drive(world, robot, wheels(0, 1), 27);  // 1.8 rad, except for slip
    EXPECT_NEAR(world.pose(robot).heading_rad - heading_rad, 1.8, 4 * slip * 1.8 + 1e-9) << "seed " << seed;
    EXPECT_NEAR(world.turned(robot).right_rad - before_rad, 3 * 1.8, 1e-9) << "the wheels turn";
    EXPECT_LE(world.pose(robot).x_m + kRadius_m, 1 + kRounding_m) << "slip moves it no deeper";
    drive(world, robot, wheels(0.5), 5);
    EXPECT_EQ(world.contact(robot), "");
    EXPECT_LT(world.pose(robot).x_m, 1 - kRadius_m - 0.01);
  }
}

TEST(Contact, WithLagTheWheelsStartAgainFromZero) {
  PlaceSettings place{.walls = Bounds{-1, 1, -1, 1}};
  World world = world_of(place);
  RobotBody b = body_at({0, 0, 0});
  b.wheels.lag_s = 0.2;
  const auto robot = *world.add_robot(b);
  drive(world, robot, wheels(0.5), 60);
  ASSERT_EQ(world.contact(robot), "wall");
  EXPECT_NEAR(world.pose(robot).x_m, 1 - kRadius_m, kTouch_m + kRounding_m);
  const double before_rad = world.turned(robot).left_rad;
  drive(world, robot, wheels(-0.5), 1);
  const double t_s = 1.0 / 15;
  EXPECT_NEAR(world.turned(robot).left_rad - before_rad, -10 * (t_s - 0.2 * (1 - std::exp(-t_s / 0.2))), 1e-8);
  EXPECT_EQ(world.contact(robot), "");
}

// Poses within a step in which the wall stops the body: it drives, then it stands.
TEST(Contact, PosesWithinTheStepStopWithTheBody) {
  PlaceSettings place{.walls = Bounds{-1, 1, -1, 1}};
  World world = world_of(place, 1);
  RobotBody b = body_at({0, 0, 0});
  b.command_timeout = std::chrono::seconds(10);
  const auto robot = *world.add_robot(b);
  world.command(robot, wheels(2));  // touches after 0.4 s
  world.step();
  EXPECT_NEAR(world.pose_before(robot, nanoseconds(700'000'000)).x_m, 0.6, 1e-9);
  EXPECT_EQ(world.pose_before(robot, nanoseconds(500'000'000)), world.pose(robot));
}

TEST(Contact, AStartThatTouchesIsRefusedAndNamed) {
  PlaceSettings place{.walls = Bounds{-3, 3, -3, 3},
                      .solids = {{"landmark red", Disc{{1, 0}, 0.2}}, {"obstacle 1", box(-2, -1, -1, 1)}},
                      .moving = {{"trolley", {{0, 2}, {1, 2}}, 0.1, true, 0.2}}};
  World world = world_of(place);
  ASSERT_TRUE(world.add_robot(body_at({0, 0, 0})));
  const auto refusal = [&world](const Pose2& start) {
    RobotBody b = body_at(start);
    b.name = "robot.2";
    const auto result = world.add_robot(b);
    return result ? std::string("taken") : result.error().message;
  };
  EXPECT_EQ(refusal({0.7, 0, 0}), "start of robot.2 touches landmark red");
  EXPECT_EQ(refusal({-0.85, 0.3, 0}), "start of robot.2 touches obstacle 1");
  EXPECT_EQ(refusal({-1.5, 0, 0}), "start of robot.2 touches obstacle 1") << "inside, away from every edge";
  EXPECT_EQ(refusal({2.9, 2, 0}), "start of robot.2 touches wall");
  EXPECT_EQ(refusal({5, 5, 0}), "start of robot.2 touches wall") << "outside";
  EXPECT_EQ(refusal({0.1, 1.7, 0}), "start of robot.2 touches moving.trolley");
  EXPECT_EQ(refusal({0.2, 0.3, 0}), "start of robot.2 touches robot");
  EXPECT_EQ(refusal({0.3, -0.5, 0}), "taken");
  RobotBody b = body_at({1, 0, 0});
  b.radius_m = 0;
  EXPECT_TRUE(world.add_robot(b)) << "a point touches nothing";
  RobotBody late = body_at({0, 0, 0});
  EXPECT_EQ(world.add_robot(late).error().code, ErrorCode::kRefused);
}

// ---- robots among themselves

struct Pair {
  Pose2 a, b;
  std::string touches_a, touches_b;
};
/// Drives two robots. `a_first` states which of them joins the world first.
Pair meet(bool a_first, const RobotBody& a, const WheelSpeeds& of_a, const RobotBody& b, const WheelSpeeds& of_b,
          int steps, double rate_hz) {
  World world = world_of(PlaceSettings{}, rate_hz);
  const auto first = *world.add_robot(a_first ? a : b);
  const auto second = *world.add_robot(a_first ? b : a);
  const auto id_a = a_first ? first : second;
  const auto id_b = a_first ? second : first;
  for (int i = 0; i < steps; ++i) {
    world.command(id_a, of_a);
    world.command(id_b, of_b);
    world.step();
  }
  return {world.pose(id_a), world.pose(id_b), world.contact(id_a), world.contact(id_b)};
}

// Catches robots that move one after the other: the first one would get farther than its share of the way.
TEST(Contact, TwoThatDriveAtEachOtherStopTouchingInAnyOrderOfJoining) {
  RobotBody a = body_at({-1.2, 0.05, 0});
  RobotBody b = body_at({1.3, 0, std::numbers::pi});
  a.name = "robot.1";
  b.name = "robot.2";
  b.radius_m = 0.27;
  for (const double rate_hz : {2.0, 15.0}) {
    const Pair one = meet(true, a, wheels(1.1), b, wheels(0.6), 50, rate_hz);
    const Pair other = meet(false, a, wheels(1.1), b, wheels(0.6), 50, rate_hz);
    EXPECT_EQ(one.a, other.a);
    EXPECT_EQ(one.b, other.b);
    EXPECT_EQ(one.touches_a, "robot.2");
    EXPECT_EQ(one.touches_b, "robot.1");
    const double apart_m = std::hypot(one.a.x_m - one.b.x_m, one.a.y_m - one.b.y_m);
    EXPECT_GE(apart_m, 0.47 - kRounding_m);
    EXPECT_LE(apart_m, 0.47 + kTouch_m);
    EXPECT_NEAR((one.a.x_m + 1.2) / 1.1, (1.3 - one.b.x_m) / 0.6, 1e-9) << "they drove for the same time";
  }
}

TEST(Contact, AFasterRobotStaysBehindASlowerOne) {
  RobotBody a = body_at({-1, 0, 0});
  RobotBody b = body_at({0, 0, 0});
  b.name = "robot.2";
  const Pair p = meet(true, a, wheels(1), b, wheels(0.3), 45, 15);
  EXPECT_NEAR(p.b.x_m, 0.9, 1e-9) << "the robot that drives away is not held";
  EXPECT_GE(p.b.x_m - p.a.x_m, 2 * kRadius_m - kRounding_m);
  EXPECT_LE(p.b.x_m - p.a.x_m, 2 * kRadius_m + 0.3 / 15 + 1e-9) << "a touch holds it until the end of the step at most";
}

TEST(Contact, AnAbandonedRobotStandsInTheWayUntilItIsRemoved) {
  World world = world_of(PlaceSettings{});
  RobotBody other = body_at({1, 0, 0});
  other.name = "robot.2";
  const auto robot = *world.add_robot(body_at({0, 0, 0}));
  const auto abandoned = *world.add_robot(other);
  world.command(abandoned, wheels(0.5));
  world.abandon(abandoned);
  drive(world, robot, wheels(0.5), 45);
  EXPECT_EQ(world.pose(abandoned), other.start);
  EXPECT_EQ(world.contact(robot), "robot.2");
  EXPECT_NEAR(world.pose(robot).x_m, 1 - 2 * kRadius_m, kTouch_m + kRounding_m);
  world.remove(abandoned);
  EXPECT_EQ(world.contact(robot), "");
  drive(world, robot, wheels(0.5), 45);
  EXPECT_GT(world.pose(robot).x_m, 1.5);
}

// Three robots touch in one step: none is overrun, in any order of joining.
TEST(Contact, ThreeInARowMeetWithoutOverlap) {
  std::vector<std::vector<Pose2>> ends;
  std::vector<int> order{0, 1, 2};
  do {
    World world = world_of(PlaceSettings{}, 3);
    std::vector<World::RobotId> ids(3);
    for (const int i : order) {
      RobotBody b = body_at({-1.0 + i, 0, i == 2 ? std::numbers::pi : 0});
      b.name = "robot." + std::to_string(i + 1);
      ids[i] = *world.add_robot(b);
    }
    for (int i = 0; i < 20; ++i) {
      world.command(ids[0], wheels(0.5));
      world.command(ids[1], wheels(i % 5 == 0 ? 0.2 : 0));
      world.command(ids[2], wheels(0.5));
      world.step();
      EXPECT_GE(world.pose(ids[1]).x_m - world.pose(ids[0]).x_m, 2 * kRadius_m - kRounding_m);
      EXPECT_GE(world.pose(ids[2]).x_m - world.pose(ids[1]).x_m, 2 * kRadius_m - kRounding_m);
    }
    ends.push_back({world.pose(ids[0]), world.pose(ids[1]), world.pose(ids[2])});
  } while (std::next_permutation(order.begin(), order.end()));
  for (const auto& end : ends) EXPECT_EQ(end, ends.front());
}

// ---- moving things

TEST(Contact, AMovingThingInTheWayStopsTheRobot) {
  PlaceSettings place{.moving = {{"trolley", {{1, -2}, {1, 2}}, 0.4, true, 0.3}}};
  World world = world_of(place, 5);
  RobotBody b = body_at({0.2, 0, 0});
  const auto robot = *world.add_robot(b);
  std::string touched;
  for (int i = 0; i < 60; ++i) {
    drive(world, robot, wheels(i < 20 ? 0.01 : 0), 1);
    if (!world.contact(robot).empty()) touched = world.contact(robot);
  }
  EXPECT_EQ(touched, "") << "0.04 m of driving does not bring it near";

  World closer = world_of(place, 5);
  const auto near = *closer.add_robot(body_at({0.55, 0, 0}));
  int contacts = 0;
  for (int i = 0; i < 60; ++i) {
    closer.step();
    contacts += closer.contact(near) == "moving.trolley";
  }
  EXPECT_GT(contacts, 3) << "the thing runs into a standing robot";
  EXPECT_EQ(closer.pose(near), (Pose2{0.55, 0, 0})) << "and does not move it";
  EXPECT_NEAR(closer.moving_pose_before(0, {}).y_m, 2 - 0.8, 1e-9) << "the thing continues along its path";
  EXPECT_EQ(closer.contact(near), "") << "and is gone";
}

TEST(Contact, AnOverrunRobotCanMoveOutButNotDeeper) {
  PlaceSettings place{.moving = {{"trolley", {{-2, 0}, {-0.3, 0}}, 0.5, false, 0.3}}};
  World world = world_of(place, 5);
  const auto robot = *world.add_robot(body_at({0, 0, 0}));
  while (world.now() < std::chrono::seconds(5)) world.step();
  ASSERT_EQ(world.contact(robot), "moving.trolley");
  drive(world, robot, wheels(-0.5), 5);
  EXPECT_EQ(world.pose(robot).x_m, 0) << "deeper";
  drive(world, robot, wheels(0.5), 5);
  EXPECT_NEAR(world.pose(robot).x_m, 0.5, 1e-9) << "out";
  EXPECT_EQ(world.contact(robot), "");
}

}  // namespace
}  // namespace twocone::sim_povray
