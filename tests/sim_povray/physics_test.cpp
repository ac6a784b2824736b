// SPDX-License-Identifier: Apache-2.0
// Robots with mass are compared with closed forms. Speeds are computed from poses: at 2000 Hz, one step of the world is
// one step of the engine.
#include "drivers/sim_povray/world/physics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "drivers/sim_povray/world/world.h"
#include "tests/sim_povray/wheels_of_body.h"

namespace twocone::sim_povray {
namespace {

constexpr double kStep_s = PhysicsEngine::kStep_s;
constexpr double kFine_hz = 2000;  // 1 / kStep_s
constexpr double kMass_kg = 4.3;
constexpr double kFriction = 0.63;
constexpr double kMost_mps2 = kFriction * PhysicsEngine::kGravity_mps2;

RobotBody heavy(const Pose2& start) {
  RobotBody b = body_at(start);
  b.command_timeout = std::chrono::seconds(1000);
  b.physics = Physics{kMass_kg, kFriction, 0.3};
  return b;
}

World fine_world_of(const PlaceSettings& place, double rate_hz = kFine_hz) { return world_of(place, rate_hz); }

struct Velocity {
  double x_mps, y_mps, turn_radps;
  [[nodiscard]] double speed_mps() const { return std::hypot(x_mps, y_mps); }
};
Velocity velocity(const Pose2& from, const Pose2& to, double dt_s) {
  return {(to.x_m - from.x_m) / dt_s, (to.y_m - from.y_m) / dt_s, wrap_angle(to.heading_rad - from.heading_rad) / dt_s};
}
/// Takes one step and returns the robot's velocity in it.
Velocity step(World& world, World::RobotId robot) {
  const Pose2 before = world.pose(robot);
  const auto then = world.now();
  world.step();
  return velocity(before, world.pose(robot), std::chrono::duration<double>(world.now() - then).count());
}

double energy_J(const Velocity& v) {
  return kMass_kg / 2 * (v.speed_mps() * v.speed_mps() + kRadius_m * kRadius_m / 2 * v.turn_radps * v.turn_radps);
}

double seconds_of(const World& world) { return std::chrono::duration<double>(world.now()).count(); }

// ---- use of the engine

// Catches an engine that every world starts: without physics, ODE must not be initialised.
TEST(Physics, AWorldWithoutPhysicsDoesNotStartTheEngine) {
  const int before = PhysicsEngine::opened();
  PlaceSettings place{.walls = Bounds{-1, 1, -1, 1}};
  World world = fine_world_of(place, 15);
  RobotBody light = heavy({});
  light.physics.reset();
  const auto robot = *world.add_robot(light);
  world.command(robot, wheels(0.5));
  for (int i = 0; i < 60; ++i) world.step();
  EXPECT_EQ(PhysicsEngine::opened(), before);
  RobotBody other = heavy({-0.5, 0, 0});
  ASSERT_TRUE(world.add_robot(other));
  EXPECT_EQ(PhysicsEngine::opened(), before + 1);
}

// ---- friction of the wheels on the floor

// Below the limit of friction, a robot with mass follows the path of a robot without mass, except for the steps in
// which it accelerates.
TEST(Physics, WheelsThatGripDriveTheArc) {
  RobotBody b = heavy({0.3, -0.2, 0.4});
  b.wheels.lag_s = 0.3;  // accelerates by less than mu g
  World gripping = fine_world_of(PlaceSettings{}, 15);
  const auto robot = *gripping.add_robot(b);
  b.physics.reset();
  World exact = fine_world_of(PlaceSettings{}, 15);
  const auto reference = *exact.add_robot(b);
  for (int i = 0; i < 45; ++i) {
    gripping.command(robot, wheels(0.6, 1.3));
    exact.command(reference, wheels(0.6, 1.3));
    gripping.step();
    exact.step();
  }
  // The errors are of second order in the step: the mean change of speed or heading within a step, as world.h
  // states, and the turning of the arc within a step, (turn h)^2 / 24 of the distance.
  constexpr double kTolerance_m = kStep_s * kStep_s * (2 * 0.6 * 1.3) + 1.8 * (1.3 * kStep_s) * (1.3 * kStep_s);
  EXPECT_NEAR(gripping.pose(robot).x_m, exact.pose(reference).x_m, kTolerance_m);
  EXPECT_NEAR(gripping.pose(robot).y_m, exact.pose(reference).y_m, kTolerance_m);
  EXPECT_NEAR(wrap_angle(gripping.pose(robot).heading_rad - exact.pose(reference).heading_rad), 0, 1e-9);
  EXPECT_EQ(gripping.turned(robot).left_rad, exact.turned(reference).left_rad);
}

// The speed is v = mu g t until the speed of the rims is reached; the distance is v^2 / (2 mu g).
TEST(Physics, AcceleratesAtTheLimitOfFriction) {
  World world = fine_world_of(PlaceSettings{});
  const auto robot = *world.add_robot(heavy({}));
  world.command(robot, wheels(2.7));
  double reached_s = 0;
  while (step(world, robot).speed_mps() < 2.7 - 1e-9) {
    ASSERT_LT(seconds_of(world), 2);
    reached_s = seconds_of(world);
  }
  EXPECT_NEAR(reached_s, 2.7 / kMost_mps2, 2 * kStep_s);
  // The speed within a step is the speed at its end, which makes the distance too long by v h / 2 in total. The last
  // step may be shorter.
  EXPECT_NEAR(world.pose(robot).x_m, 2.7 * 2.7 / (2 * kMost_mps2), 2 * 2.7 * kStep_s);
  EXPECT_NEAR(world.turned(robot).left_rad, 2.7 / 0.05 * seconds_of(world), 1e-9) << "the wheels spin from the start";
}

// With locked wheels the distance is v^2 / (2 mu g) for every heading.
TEST(Physics, BrakesWithLockedWheelsOverTheRightDistance) {
  for (const double heading_rad : {0.0, 0.7}) {
    World world = fine_world_of(PlaceSettings{});
    const auto robot = *world.add_robot(heavy({0, 0, heading_rad}));
    world.command(robot, wheels(3.1));
    while (step(world, robot).speed_mps() < 3.1 - 1e-9) ASSERT_LT(seconds_of(world), 2);
    const Pose2 from = world.pose(robot);
    world.halt(robot);
    double speed_mps = 3.1;
    for (int i = 0; i < 2000; ++i) {
      const double slower_mps = step(world, robot).speed_mps();
      ASSERT_LE(slower_mps, speed_mps + 1e-9);
      speed_mps = slower_mps;
    }
    EXPECT_NEAR(speed_mps, 0, 1e-9);
    const double way_m = std::hypot(world.pose(robot).x_m - from.x_m, world.pose(robot).y_m - from.y_m);
    EXPECT_NEAR(way_m, 3.1 * 3.1 / (2 * kMost_mps2), 3.1 * kStep_s);
  }
}

// The robot drives a circle of radius r while v^2 / r < mu g. Above this limit the acceleration of its path is mu g and
// no more, and it slides outwards. Catches friction that is limited separately along and across the wheel, which allows
// 1.41 mu g in the diagonal direction.
TEST(Physics, SlidesOutOfTooTightATurn) {
  const auto acceleration = [](double speed_mps, double turn_radps, double* greatest_mps2) {
    World world = fine_world_of(PlaceSettings{});
    const auto robot = *world.add_robot(heavy({}));
    Velocity last{0, 0, 0};
    *greatest_mps2 = 0;
    for (int i = 0; i < 6000; ++i) {
      // The speed rises slowly, so that only the turn requires friction.
      const double share = std::min(1.0, i / 4000.0);
      world.command(robot, wheels(share * speed_mps, share * turn_radps));
      const Velocity now = step(world, robot);
      *greatest_mps2 = std::max(*greatest_mps2, std::hypot(now.x_mps - last.x_mps, now.y_mps - last.y_mps) / kStep_s);
      last = now;
    }
    return last;
  };
  double greatest_mps2 = 0;
  const Velocity grips = acceleration(2.0, 0.95 * kMost_mps2 / 2.0, &greatest_mps2);  // v w = 0.95 mu g
  EXPECT_NEAR(grips.speed_mps(), 2.0, 1e-6);
  EXPECT_NEAR(grips.turn_radps, 0.95 * kMost_mps2 / 2.0, 1e-6);
  // The rising speed adds 1 m/s^2 along the path to the acceleration across it, and the wheels still grip. The
  // tolerance is for the rounding of coordinates.
  EXPECT_LT(greatest_mps2, kMost_mps2 * (1 + 1e-6));

  const Velocity slides = acceleration(2.0, 1.6 * kMost_mps2 / 2.0, &greatest_mps2);
  EXPECT_NEAR(greatest_mps2, kMost_mps2, 1e-3 * kMost_mps2);
  EXPECT_LT(slides.speed_mps() * slides.turn_radps, 1.6 * kMost_mps2 * 0.9);
}

// ---- contact

TEST(Physics, APanelOfTwoMillimetresStopsTenMetresPerSecond) {
  PlaceSettings place{.solids = {{"panel", Outline{{9, -5}, {9.002, -5}, {9.002, 5}, {9, 5}}}}};
  World world = fine_world_of(place, 15);
  RobotBody b = heavy({0, 0, 0.2});
  b.physics->wheel_friction = 30;  // so that it is fast enough after a short distance
  const auto robot = *world.add_robot(b);
  world.command(robot, wheels(10));
  double fastest_mps = 0;
  for (int i = 0; i < 60; ++i) {
    const Velocity v = step(world, robot);
    fastest_mps = std::max(fastest_mps, v.speed_mps());
    ASSERT_LE(world.pose(robot).x_m + kRadius_m, 9 + 1e-6) << "step " << i;
  }
  EXPECT_GT(fastest_mps, 9.9);
  EXPECT_EQ(world.contact(robot), "panel");
  EXPECT_NEAR(world.turned(robot).left_rad, 10 / 0.05 * 4, 1e-6) << "the wheels turn as commanded, blocked or not";
}

TEST(Physics, ARobotPressedToAWallStaysAndLeavesOnCommand) {
  PlaceSettings place{.walls = Bounds{-2, 1, -2, 2}, .solids = {{"landmark red", Disc{{-1, 0}, 0.1}}}};
  World world = fine_world_of(place, 15);
  const auto robot = *world.add_robot(heavy({0, 0, 0}));
  drive(world, robot, wheels(0.5), 60);
  EXPECT_EQ(world.contact(robot), "wall");
  EXPECT_NEAR(world.pose(robot).x_m, 1 - kRadius_m, kGap_m);
  drive(world, robot, wheels(-0.5), 1);
  EXPECT_EQ(world.contact(robot), "");
  drive(world, robot, wheels(-0.5), 59);
  EXPECT_EQ(world.contact(robot), "landmark red");
  EXPECT_NEAR(world.pose(robot).x_m, -1 + 0.1 + kRadius_m, kGap_m);
}

// The robot drives along a wall at an angle. The friction of the wall slows it, and no edge of the wall stops it.
TEST(Physics, SlidesAlongAWallOfManyEdges) {
  PlaceSettings place;
  Outline jagged{{-5, 1.5}};
  for (int i = 0; i <= 40; ++i) jagged.push_back({-5 + i * 0.25, 1});
  jagged.push_back({5, 1.5});
  place.solids = {{"bench", jagged}};
  World world = fine_world_of(place, 15);
  RobotBody b = heavy({-3, 0.7, 0.25});
  b.physics->body_friction = 0.1;
  const auto robot = *world.add_robot(b);
  // The wheels push the robot into the bench at an angle as long as its heading lasts.
  for (int i = 0; i < 30; ++i) {
    world.command(robot, wheels(0.5));
    world.step();
    ASSERT_LE(world.pose(robot).y_m, 1 - kRadius_m + 1e-6);
  }
  EXPECT_GT(world.pose(robot).x_m, -3 + 0.5 * 2 * 0.8);
}

// A moving thing hits the robot at an angle, on a floor without friction. Along the line of centres the robot takes the
// thing's speed v_n at once. Across it, Coulomb's impulse gives the speed mu v_n (the contact slides, because this is
// less than the 1/3 at which it would stick) and a spin of 2 mu v_n / R. Catches friction of the wrong size or
// direction, and a wrong moment of inertia.
TEST(Physics, FrictionOfTheBodyIsCoulombFriction) {
  PlaceSettings place;
  place.moving = {
      {"trolley", {{-1, 0.3}, {3, 0.3}}, 0.8, false, 0.3}};  // touches with the line of centres at -37 degrees
  World world = fine_world_of(place);
  RobotBody b = heavy({0, 0, 0.6});
  b.physics->wheel_friction = 1e-9;
  b.physics->body_friction = 0.12;
  const auto robot = *world.add_robot(b);
  Velocity v{0, 0, 0};
  for (int i = 0; i < 4000 && v.speed_mps() < 0.1; ++i) v = step(world, robot);
  v = step(world, robot);         // the touch may have happened within a step
  constexpr double kAlong = 0.8;  // cos of the angle: centres 0.5 m apart, 0.3 m of that across
  constexpr double kAcross = -0.6;
  constexpr double kNormal_mps = 0.8 * kAlong;
  constexpr double kTangent_mps = 0.12 * kNormal_mps;  // along the motion of the thing's face: (0.6, 0.8)
  // The line of centres turns by v h / 0.5 m in each of two steps.
  constexpr double kTolerance_mps = 0.8 * 2 * 2 * 0.8 * kStep_s / 0.5;
  EXPECT_NEAR(v.x_mps, kNormal_mps * kAlong - kTangent_mps * kAcross, kTolerance_mps);
  EXPECT_NEAR(v.y_mps, kNormal_mps * kAcross + kTangent_mps * kAlong, kTolerance_mps);
  // The impulse acts on the side of the thing, which is at the left and behind.
  EXPECT_NEAR(v.turn_radps, -2 * kTangent_mps / kRadius_m, 2 * kTolerance_mps / kRadius_m);
}

// With restitution 0 both robots get one common speed along the line of centres. The momentum is kept except for the
// part that the floor takes in a step, mu m g h for each robot.
TEST(Physics, ACollisionKeepsMomentumAndMakesNoEnergy) {
  World world = fine_world_of(PlaceSettings{});
  RobotBody standing = heavy({3, 0.1, 0.4});
  standing.name = "robot.2";
  standing.physics->body_friction = 0;
  RobotBody running = heavy({0, 0, 0});
  running.physics->body_friction = 0;
  const auto a = *world.add_robot(running);
  const auto b = *world.add_robot(standing);
  world.command(a, wheels(2.5));
  Velocity va{0, 0, 0};
  Velocity vb{0, 0, 0};
  bool met = false;
  for (int i = 0; i < 6000 && !met; ++i) {
    const Pose2 a_before = world.pose(a);
    const Pose2 b_before = world.pose(b);
    world.step();
    const Pose2& pa = world.pose(a);
    const Pose2& pb = world.pose(b);
    const Velocity na{(pa.x_m - a_before.x_m) / kStep_s, (pa.y_m - a_before.y_m) / kStep_s, 0};
    const Velocity nb{(pb.x_m - b_before.x_m) / kStep_s, (pb.y_m - b_before.y_m) / kStep_s, 0};
    if (nb.speed_mps() > 0.01) {
      met = true;
      // Two steps are compared: the robots touch in the first and move together in the second.
      const Pose2 a1 = pa;
      const Pose2 b1 = pb;
      world.step();
      const Velocity ea{(world.pose(a).x_m - a1.x_m) / kStep_s, (world.pose(a).y_m - a1.y_m) / kStep_s, 0};
      const Velocity eb{(world.pose(b).x_m - b1.x_m) / kStep_s, (world.pose(b).y_m - b1.y_m) / kStep_s, 0};
      const double floor_mps = 2 * 2 * kMost_mps2 * kStep_s;  // two steps, two robots of one mass
      EXPECT_NEAR(ea.x_mps + eb.x_mps, va.x_mps + vb.x_mps, floor_mps);
      EXPECT_NEAR(ea.y_mps + eb.y_mps, va.y_mps + vb.y_mps, floor_mps);
      const double length_m = std::hypot(b1.x_m - a1.x_m, b1.y_m - a1.y_m);
      const double nx = (b1.x_m - a1.x_m) / length_m;
      const double ny = (b1.y_m - a1.y_m) / length_m;
      // They neither bounce off nor overlap. Within a step their motion turns the line of centres a little.
      EXPECT_NEAR((eb.x_mps - ea.x_mps) * nx + (eb.y_mps - ea.y_mps) * ny, 0, 0.01);
      EXPECT_LE(energy_J(ea) + energy_J(eb), energy_J(va) + energy_J(vb) + kMass_kg * 2.5 * kMost_mps2 * kStep_s);
      EXPECT_GT(eb.speed_mps(), 1);
    }
    va = na;
    vb = nb;
  }
  EXPECT_TRUE(met);
}

// With locked wheels nothing adds energy. The energy falls in every step, through many collisions.
TEST(Physics, EnergyNeverIncreases) {
  PlaceSettings place{
      .walls = Bounds{-2, 2, -1.2, 1.2},
      .solids = {{"landmark", Disc{{0.2, 0.5}, 0.1}}, {"wedge", Outline{{0.5, -1.2}, {1, -1.2}, {0.7, -0.6}}}}};
  World world = fine_world_of(place);
  std::vector<World::RobotId> robots;
  for (int i = 0; i < 4; ++i) {
    RobotBody b = heavy({-1.5 + 0.9 * i, 0.35 * (i % 2) - 0.2, i < 2 ? 0.15 * i : std::numbers::pi + 0.1 * i});
    b.name = "robot." + std::to_string(i + 1);
    b.physics->wheel_friction = 0.2;
    robots.push_back(*world.add_robot(b));
    world.command(robots.back(), wheels(3, 0.5 * i));
  }
  for (int i = 0; i < 600; ++i) world.step();
  for (const auto robot : robots) world.halt(robot);
  double last_J = std::numeric_limits<double>::infinity();
  double first_J = 0;
  for (int i = 0; i < 3000; ++i) {
    std::vector<Pose2> before;
    for (const auto robot : robots) before.push_back(world.pose(robot));
    world.step();
    double now_J = 0;
    for (std::size_t k = 0; k < robots.size(); ++k) {
      now_J += energy_J(velocity(before[k], world.pose(robots[k]), kStep_s));
    }
    if (i == 0) first_J = now_J;
    // Speeds are computed from coordinates of a few metres: eps x 2 m / 0.5 ms, times m v.
    ASSERT_LE(now_J, last_J + 1e-10) << "step " << i;
    last_J = now_J;
  }
  EXPECT_GT(first_J, 1);
  EXPECT_NEAR(last_J, 0, 1e-12);
}

TEST(Physics, AThingOnRailsPushesARobotAlong) {
  PlaceSettings place{.moving = {{"trolley", {{-2, 0.02}, {3, 0.02}}, 0.5, false, 0.3}}};
  World world = fine_world_of(place, 15);
  const auto robot = *world.add_robot(heavy({0, 0, std::numbers::pi / 2}));
  for (int i = 0; i < 15 * 5; ++i) {
    world.step();
    const Pose2 thing = world.moving_pose_before(0, {});
    ASSERT_GE(std::hypot(world.pose(robot).x_m - thing.x_m, world.pose(robot).y_m - thing.y_m), 0.5 - 1e-6);
  }
  EXPECT_NEAR(world.moving_pose_before(0, {}).x_m, 0.5, 1e-9) << "nothing stops a thing on rails";
  EXPECT_GT(world.pose(robot).x_m, 0.9) << "pushed aside by a small distance at most";
  EXPECT_EQ(world.contact(robot), "moving.trolley");
}

TEST(Physics, ARobotWithoutMassActsAsAWallAndStopsAtOthers) {
  for (const bool heavy_drives : {true, false}) {
    World world = fine_world_of(PlaceSettings{}, 15);
    RobotBody light = heavy({1, 0, std::numbers::pi});
    light.physics.reset();
    light.name = "robot.2";
    const auto a = *world.add_robot(heavy({0, 0, 0}));
    const auto b = *world.add_robot(light);
    world.command(heavy_drives ? a : b, wheels(0.5));
    for (int i = 0; i < 45; ++i) world.step();
    EXPECT_NEAR(world.pose(b).x_m - world.pose(a).x_m, 2 * kRadius_m, kGap_m) << heavy_drives;
    EXPECT_EQ(world.contact(a), "robot.2");
    EXPECT_EQ(world.contact(b), "robot");
    EXPECT_NEAR(heavy_drives ? world.pose(b).x_m : world.pose(a).x_m, heavy_drives ? 1 : 0, 1e-12) << "stands";
  }
}

TEST(Physics, AnAbandonedRobotCannotBePushed) {
  World world = fine_world_of(PlaceSettings{}, 15);
  RobotBody other = heavy({1, 0, 0});
  other.name = "robot.2";
  const auto robot = *world.add_robot(heavy({0, 0, 0}));
  const auto gone = *world.add_robot(other);
  world.abandon(gone);
  world.command(robot, wheels(0.5));
  for (int i = 0; i < 45; ++i) world.step();
  EXPECT_EQ(world.pose(gone), other.start);
  EXPECT_EQ(world.contact(robot), "robot.2");
  world.remove(gone);
  for (int i = 0; i < 45; ++i) world.step();
  EXPECT_GT(world.pose(robot).x_m, 1.5);
}

TEST(Physics, PosesWithinTheStepLieOnThePath) {
  World world = fine_world_of(PlaceSettings{}, 4);
  const auto robot = *world.add_robot(heavy({}));
  world.command(robot, wheels(0.5, 1));
  world.step();
  world.step();
  // The wheels grip all the time. So half a step ago the robot was half an arc back, to second order of the engine's
  // step.
  const Pose2 there = world.pose_before(robot, std::chrono::nanoseconds(125'300'000));
  const Pose2 back = advance(there, {0.5, 1}, 0.1253);
  EXPECT_NEAR(back.x_m, world.pose(robot).x_m, 1e-6);
  EXPECT_NEAR(back.y_m, world.pose(robot).y_m, 1e-6);
  EXPECT_NEAR(back.heading_rad, world.pose(robot).heading_rad, 1e-9);
}

// ---- several worlds

Pose2 run_of(int steps) {
  PlaceSettings place{.walls = Bounds{-1, 1, -1, 1}};
  World world = fine_world_of(place, 15);
  const auto a = *world.add_robot(heavy({-0.5, 0, 0.3}));
  RobotBody other = heavy({0.5, 0.1, 3});
  other.name = "robot.2";
  const auto b = *world.add_robot(other);
  for (int i = 0; i < steps; ++i) {
    world.command(a, wheels(0.9, 0.4));
    world.command(b, wheels(0.7, -0.2));
    world.step();
  }
  return world.pose(a);
}

// Catches an engine that is closed while another world uses it, and one that is not initialised for a second thread.
TEST(Physics, WorldsOnOtherThreadsDoNotDisturbEachOther) {
  const Pose2 expected = run_of(40);
  std::vector<Pose2> ends(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    threads.emplace_back([&ends, i] {
      for (int round = 0; round < 3; ++round) ends[i] = run_of(40);
    });
  }
  for (std::thread& t : threads) t.join();
  for (const Pose2& end : ends) EXPECT_EQ(end, expected);
}

// A world may be created on one thread, stepped on another and reset on a third.
TEST(Physics, AWorldMayChangeThreads) {
  World world = fine_world_of(PlaceSettings{}, 15);
  const auto robot = *world.add_robot(heavy({}));
  world.command(robot, wheels(0.5));
  std::thread([&world] { world.step(); }).join();
  EXPECT_GT(world.pose(robot).x_m, 0.01);
  std::thread([moved = std::move(world)]() mutable { moved.begin_anew(); }).join();
}

}  // namespace
}  // namespace twocone::sim_povray
