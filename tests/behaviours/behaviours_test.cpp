// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "apps/behaviours/behaviour.h"

namespace twocone::behaviours {
namespace {

using localisation::Pose;

const Body kBody{.radius_m = 0.2, .max_speed_mps = 0.5, .wheel_separation_m = 0.3};

/// Returns a room of 6 m by 5 m with a box and a landmark.
Arena room() {
  return {{-3, -2.5}, {3, 2.5}, {{{-1, 0.9}, {-0.4, 0.9}, {-0.4, 1.3}, {-1, 1.3}}}, {{{1.2, -0.8}, 0.2}}};
}

/// Returns the pose after a motion without error.
Pose moved(const Pose& p, const Motion& m, double dt_s) {
  const double course = p.heading_rad + m.turn_rate_radps * dt_s / 2;
  return {p.x_m + m.speed_mps * dt_s * std::cos(course), p.y_m + m.speed_mps * dt_s * std::sin(course),
          localisation::wrap_angle_rad(p.heading_rad + m.turn_rate_radps * dt_s)};
}

TEST(Arena, ClearanceIsTheDistanceToTheNearestThing) {
  const Arena arena = room();
  EXPECT_DOUBLE_EQ(arena.clearance_m({-2.7, 0}), 0.3);       // wall
  EXPECT_DOUBLE_EQ(arena.clearance_m({0, 1.1}), 0.4);        // side of the box
  EXPECT_NEAR(arena.clearance_m({-0.1, 1.7}), 0.5, 1e-15);   // corner of the box, 3-4-5
  EXPECT_NEAR(arena.clearance_m({1.2, -0.3}), 0.3, 1e-15);   // landmark
  EXPECT_NEAR(arena.clearance_m({-0.7, 1.2}), -0.1, 1e-15);  // inside the box
  EXPECT_NEAR(arena.clearance_m({1.2, -0.7}), -0.1, 1e-15);  // inside the landmark
  EXPECT_DOUBLE_EQ(arena.clearance_m({3.5, 0}), -0.5);       // beyond a wall
}

TEST(Still, DoesNotMove) {
  Still still;
  const Motion m = still.decide({1, 2, 3}, 0.1);
  EXPECT_EQ(m.speed_mps, 0);
  EXPECT_EQ(m.turn_rate_radps, 0);
}

TEST(Manual, DrivesAsRequestedWithinTheWheelsSpeed) {
  Shares requested;
  Manual manual(kBody, [&] { return requested; });
  const auto decided = [&](double speed, double turn) {
    requested = {speed, turn};
    return manual.decide({}, 0.1);
  };
  EXPECT_EQ(decided(0, 0).speed_mps, 0);
  EXPECT_DOUBLE_EQ(decided(0.5, 0).speed_mps, 0.25);
  EXPECT_DOUBLE_EQ(decided(-1, 0).speed_mps, -0.5);
  EXPECT_GT(decided(0, 0.5).turn_rate_radps, 0);
  EXPECT_DOUBLE_EQ(decided(0, 0.5).turn_rate_radps, -decided(0, -0.5).turn_rate_radps);
  for (const double speed : {-7.0, -1.0, 0.3, 1.0, std::numeric_limits<double>::infinity()}) {
    for (const double turn : {-1.0, 0.7, 9.0}) {
      const Motion m = decided(speed, turn);
      const double wheel_mps = std::abs(m.speed_mps) + std::abs(m.turn_rate_radps) * kBody.wheel_separation_m / 2;
      EXPECT_LE(wheel_mps, kBody.max_speed_mps * (1 + 1e-12)) << speed << ", " << turn;
    }
  }
  EXPECT_EQ(decided(std::numeric_limits<double>::quiet_NaN(), 0).speed_mps, 0);
}

TEST(Wander, KeepsClearTravelsAndTurnsThroughAllHeadings) {
  // A minute at 0.35 m/s on straight parts. At least a quarter of it must be spent there, whatever the random turns
  // are.
  constexpr double kStep_s = 1.0 / 15;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Wander wander(kBody, room(), seed);
    Pose pose{0, 0, 0.3};
    double least_m = 9;
    double travelled_m = 0;
    std::set<int> headings;
    for (int i = 0; i < 900; ++i) {
      const Motion m = wander.decide(pose, kStep_s);
      pose = moved(pose, m, kStep_s);
      travelled_m += m.speed_mps * kStep_s;
      least_m = std::min(least_m, room().clearance_m({pose.x_m, pose.y_m}));
      headings.insert(int(std::floor((pose.heading_rad + std::numbers::pi) / (2 * std::numbers::pi) * 12)) % 12);
    }
    EXPECT_GT(least_m, kBody.radius_m) << "seed " << seed;
    EXPECT_GT(travelled_m, 5) << "seed " << seed;
    EXPECT_EQ(headings.size(), 12U) << "seed " << seed;
  }
}

TEST(Wander, TheSameSeedDecidesTheSame) {
  Wander a(kBody, room(), 5);
  Wander b(kBody, room(), 5);
  Wander other(kBody, room(), 6);
  bool differs = false;
  for (int i = 0; i < 300; ++i) {
    const Pose pose{2.75, 0, 0.1 * i};
    const Motion m = a.decide(pose, 0.07);
    EXPECT_EQ(m.turn_rate_radps, b.decide(pose, 0.07).turn_rate_radps);
    differs = differs || m.turn_rate_radps != other.decide(pose, 0.07).turn_rate_radps;
  }
  EXPECT_TRUE(differs);
}

TEST(Wander, LeavesAPlaceThatIsTooClose) {
  Wander wander(kBody, room(), 1);
  // The belief is 0.1 m from the wall, facing away from it. The way out is free.
  EXPECT_GT(wander.decide({-2.9, 0, 0}, 0.07).speed_mps, 0);
  EXPECT_EQ(Wander(kBody, room(), 1).decide({-2.9, 0, std::numbers::pi}, 0.07).speed_mps, 0);
}

// Catches obstacles that pile up, and those of the map that are lost with them.
TEST(Wander, AvoidsWhatWasFoundOnTheWay) {
  const Pose before_it{0.9, 0.5, 0};
  EXPECT_GT(Wander(kBody, room(), 1).decide(before_it, 0.07).speed_mps, 0);
  Wander wander(kBody, room(), 1);
  wander.avoid({{{1.5, 0.5}, 0.2}});
  EXPECT_EQ(wander.decide(before_it, 0.07).speed_mps, 0);
  Wander elsewhere(kBody, room(), 1);
  elsewhere.avoid({{{1.5, 0.5}, 0.2}});
  elsewhere.avoid({{{-2, -2}, 0.2}});
  EXPECT_GT(elsewhere.decide(before_it, 0.07).speed_mps, 0);
  EXPECT_EQ(elsewhere.decide({0.8, -0.8, 0}, 0.07).speed_mps, 0) << "the map's landmark";
}

TEST(Waypoints, DrivesThroughThemAllAndRoundAgain) {
  const std::vector<Eigen::Vector2d> points = {{1, 0}, {1, 1}, {-1, -1}};
  Waypoints waypoints(kBody, points);
  Pose pose{0, 0, 2};
  std::size_t reached = 0;
  for (int i = 0; i < 1500 && reached < 2 * points.size(); ++i) {
    pose = moved(pose, waypoints.decide(pose, 1.0 / 15), 1.0 / 15);
    if ((points[reached % points.size()] - Eigen::Vector2d(pose.x_m, pose.y_m)).norm() < Waypoints::kReached_m)
      ++reached;
  }
  EXPECT_EQ(reached, 2 * points.size());
}

TEST(Waypoints, NeedsPoints) { EXPECT_THROW(Waypoints(kBody, {}), std::invalid_argument); }

}  // namespace
}  // namespace twocone::behaviours
