// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/surroundings.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/sim_povray/wheels_of_body.h"

namespace twocone::sim_povray {
namespace {

using std::chrono::nanoseconds;

// A few roundings of coordinates below 4 m.
constexpr double kPathTolerance_m = 16 * std::numeric_limits<double>::epsilon();

/// A path with segments of 1.5 m and 2 m, and 2.5 m back to the start.
MovingThing triangle(bool loop) { return {"trolley", {{0.5, 1}, {2, 1}, {2, 3}}, 0.7, loop, 0.2}; }

void expect_pose(const Pose2& pose, const Pose2& expected, const char* what) {
  EXPECT_NEAR(pose.x_m, expected.x_m, kPathTolerance_m) << what;
  EXPECT_NEAR(pose.y_m, expected.y_m, kPathTolerance_m) << what;
  EXPECT_NEAR(pose.heading_rad, expected.heading_rad, kPathTolerance_m) << what;
}

TEST(MovingPath, IsAtItsFirstPointAtTimeZero) { expect_pose(MovingPath(triangle(true)).pose(0), {0.5, 1, 0}, ""); }

TEST(MovingPath, FollowsItsSegmentsAtItsSpeed) {
  const MovingPath path(triangle(true));
  expect_pose(path.pose(1.1), {0.5 + 0.77, 1, 0}, "first segment");
  expect_pose(path.pose(1.5 / 0.7 + 0.3), {2, 1.21, std::numbers::pi / 2}, "second segment");
  // The way back is (-1.5, -2) m, which is 2.5 m long.
  expect_pose(path.pose(3.5 / 0.7 + 1), {2 - 0.7 * 0.6, 3 - 0.7 * 0.8, std::atan2(-2.0, -1.5)}, "straight back");
  expect_pose(path.pose(6 / 0.7 * 3 + 1.1), {0.5 + 0.77, 1, 0}, "the fourth round");
}

TEST(MovingPath, WithoutALoopItStandsAtTheEnd) {
  const MovingPath path(triangle(false));
  expect_pose(path.pose(3.5 / 0.7 - 0.1), {2, 2.93, std::numbers::pi / 2}, "just before");
  expect_pose(path.pose(1e6), {2, 3, std::numbers::pi / 2}, "long after");
  EXPECT_EQ(path.stretch(1e6).y_mps, 0);
  EXPECT_EQ(path.stretch(1e6).until_s, std::numeric_limits<double>::infinity());
}

// Catches positions that are accumulated step by step: after eleven days the closed form must still hold.
TEST(MovingPath, NoErrorAccumulatesOverDays) {
  MovingThing square{"cart", {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 1, true, 0.1};
  expect_pose(MovingPath(square).pose(1e6 + 0.25), {0.25, 0, 0}, "a million rounds of four seconds and a quarter");
}

TEST(MovingPath, ALoopMayEndAtItsStart) {
  const MovingThing closed{"cart", {{0, 0}, {1, 0}, {0, 0}}, 0.5, true, 0.1};
  expect_pose(MovingPath(closed).pose(3), {0.5, 0, std::numbers::pi}, "on the way back");
  expect_pose(MovingPath(closed).pose(4.5), {0.25, 0, 0}, "the second round");
}

TEST(MovingPath, ReportsItsCurrentStretch) {
  const Stretch s = MovingPath(triangle(true)).stretch(1.5 / 0.7 + 0.3);
  EXPECT_NEAR(s.at.y_m, 1.21, kPathTolerance_m);
  EXPECT_NEAR(s.x_mps, 0, kPathTolerance_m);
  EXPECT_NEAR(s.y_mps, 0.7, kPathTolerance_m);
  EXPECT_NEAR(s.until_s, 3.5 / 0.7, kPathTolerance_m);
}

// Rolling shutter and motion blur need poses at times within a step, also across a corner.
TEST(MovingThings, AWorldReportsEarlierPoses) {
  PlaceSettings place{.moving = {triangle(true), triangle(false)}};
  World world = world_of(place, 2);
  expect_pose(world.moving_pose_before(0, nanoseconds(400'000'000)), {0.5, 1, 0}, "before the beginning");
  for (int i = 0; i < 5; ++i) world.step();
  expect_pose(world.moving_pose_before(0, {}), {2, 1 + 2.5 * 0.7 - 1.5, std::numbers::pi / 2}, "now");
  expect_pose(world.moving_pose_before(0, nanoseconds(500'000'000)), {0.5 + 2 * 0.7, 1, 0}, "before the corner");
  while (world.now() < std::chrono::seconds(20)) world.step();
  expect_pose(world.moving_pose_before(1, {}), {2, 3, std::numbers::pi / 2}, "the other one stands at its end");
}

}  // namespace
}  // namespace twocone::sim_povray
