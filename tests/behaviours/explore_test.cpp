// SPDX-License-Identifier: Apache-2.0
#include "apps/behaviours/explore.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "apps/behaviours/seen_floor.h"

namespace twocone::behaviours {
namespace {

using localisation::Pose;
using vision::Beam;
using vision::BeamState;

const Body kScout{.radius_m = 0.18, .max_speed_mps = 0.43, .wheel_separation_m = 0.26};
constexpr double kStep_s = 0.2;
constexpr double kReaction_s = 0.6;

/// As that of the scout: the floor from 1.35 m on.
double lowest_seen_m(double distance_m) { return std::max(0.0, 0.27 * (1.35 - distance_m) / 0.85); }

Arena walls() { return {{-2, -1.5}, {2, 1.5}, {}, {}}; }
/// The same room as it is: with a box that no map lists.
Arena furnished() {
  Arena room = walls();
  room.outlines.push_back({{0.5, -0.2}, {1.0, -0.2}, {1.0, 0.4}, {0.5, 0.4}});
  return room;
}

/// Returns what a robot sees of a room whose things have one height.
std::vector<Beam> scan_of(const Arena& room, const Pose& at, double top_m = 0.5) {
  std::vector<Beam> scan(360);
  for (std::size_t k = 0; k < scan.size(); ++k) {
    const double course_rad = at.heading_rad - std::numbers::pi + 2 * std::numbers::pi * (double(k) + 0.5) / 360;
    const Eigen::Vector2d along(std::cos(course_rad), std::sin(course_rad));
    double range_m = 0;
    double clear_m = 1;
    while (clear_m > 1e-3)
      range_m += clear_m = room.clearance_m({at.x_m + range_m * along.x(), at.y_m + range_m * along.y()});
    const bool is_shown = lowest_seen_m(range_m) < top_m;
    scan[k] = is_shown ? Beam{BeamState::kOccupied, range_m, 0.01, top_m} : Beam{BeamState::kFree, 3, 0, 0};
    for (std::uint32_t step = 0; step < 32 && step * Beam::kFloorStep_m < range_m; ++step) {
      if (lowest_seen_m(step * Beam::kFloorStep_m) <= 0) scan[k].floor |= std::uint32_t{1} << step;
    }
  }
  return scan;
}

Pose moved(const Pose& p, const Motion& m) {
  const double course_rad = p.heading_rad + m.turn_rate_radps * kStep_s / 2;
  return {p.x_m + m.speed_mps * kStep_s * std::cos(course_rad), p.y_m + m.speed_mps * kStep_s * std::sin(course_rad),
          localisation::wrap_angle_rad(p.heading_rad + m.turn_rate_radps * kStep_s)};
}

Explore explorer(const Arena& listed) { return {kScout, listed, lowest_seen_m, kReaction_s}; }

TEST(SeenFloor, IsFreeUpToWhatIsSeenAndUnknownBehindIt) {
  SeenFloor floor(walls(), lowest_seen_m);
  const Pose at{-1, 0, 0.3};
  for (int k = 0; k < 4; ++k) floor.add(at, scan_of(furnished(), at));
  const auto is_free = [&](double x_m, double y_m) { return floor.is_free(floor.cell_of({x_m, y_m})); };
  EXPECT_TRUE(is_free(0, 0));
  EXPECT_TRUE(is_free(0.3, 0));
  EXPECT_FALSE(is_free(0.51, 0));
  EXPECT_FALSE(is_free(0.75, 0.1));
  EXPECT_FALSE(is_free(1.2, 0.1));
}

TEST(SeenFloor, WhatTheMapListsIsNeverFree) {
  SeenFloor floor(furnished(), lowest_seen_m);
  const Pose at{-1, 0, 0};
  for (int k = 0; k < 20; ++k) floor.add(at, scan_of(walls(), at));  // as if it could not be seen
  EXPECT_FALSE(floor.is_free(floor.cell_of({0.75, 0.1})));
  EXPECT_TRUE(floor.is_free(floor.cell_of({0.3, 0.1})));
}

TEST(SeenFloor, ALowThingStaysWhenTheRobotComesNearAndGoesAfterItWasSeenToBeGone) {
  constexpr double kTop_m = 0.2;
  SeenFloor floor(walls(), lowest_seen_m);
  const std::size_t edge = floor.cell_of({0.49, 0.1});
  const Pose start{-1.8, -1.2, 0};
  floor.add(start, scan_of(furnished(), start, kTop_m));
  const Pose far{-1.2, 0, 0};
  for (int k = 0; k < 3; ++k) floor.add(far, scan_of(furnished(), far, kTop_m));
  ASSERT_FALSE(floor.is_free(edge));
  const Pose near{-0.1, 0, 0};
  ASSERT_GT(lowest_seen_m(0.6), kTop_m);
  for (int k = 0; k < 50; ++k) floor.add(near, scan_of(furnished(), near, kTop_m));
  EXPECT_FALSE(floor.is_free(edge)) << "the mirrors look over it from here";
  EXPECT_FALSE(floor.is_free(floor.cell_of({0.75, 0.1}))) << "likewise, and what is behind its edge was never seen";
  for (int k = 0; k < 20; ++k) floor.add(far, scan_of(walls(), far));
  EXPECT_TRUE(floor.is_free(edge)) << "it has gone";
  EXPECT_TRUE(floor.is_busy(edge));
  EXPECT_TRUE(floor.was_busy_within(edge, 20));
  for (int k = 0; k < 20; ++k) floor.add(far, scan_of(walls(), far));
  EXPECT_FALSE(floor.was_busy_within(edge, 20));
}

TEST(SeenFloor, AThingOfTwoScansGoesOnlyWhereTheFloorIsRanged) {
  const Pose at{-1.2, 0, 0};
  const auto without_floor = [](std::vector<Beam> scan) {
    for (Beam& beam : scan) beam.floor = 0;
    return scan;
  };
  for (const int scans : {1, 2}) {
    SeenFloor floor(walls(), lowest_seen_m);
    const std::size_t edge = floor.cell_of({0.49, 0.1});
    for (int k = 0; k < 5; ++k) floor.add(at, scan_of(walls(), at));
    for (int k = 0; k < scans; ++k) floor.add(at, scan_of(furnished(), at, 0.2));
    EXPECT_FALSE(floor.is_free(edge)) << scans;
    for (int k = 0; k < 30; ++k) floor.add(at, without_floor(scan_of(walls(), at)));
    EXPECT_EQ(floor.is_free(edge), scans == 1) << "single wrong ranges are usual";
    for (int k = 0; k < 30; ++k) floor.add(at, scan_of(walls(), at));
    EXPECT_TRUE(floor.is_free(edge)) << scans;
  }
}

// Catches a table that goes because floor is ranged under it, where its edge is not, or is too far to be ranged.
TEST(SeenFloor, AnEdgeThatFewBeamsShowStaysWithFloorUnderIt) {
  const auto with_gaps = [](std::vector<Beam> scan, const std::vector<Beam>& without) {
    for (std::size_t k = 0; k < scan.size(); ++k) {
      scan[k].floor = without[k].floor;
      if (k % 8 > 2) scan[k] = without[k];
    }
    return scan;
  };
  SeenFloor floor(walls(), lowest_seen_m);
  const std::size_t edge = floor.cell_of({0.49, 0.1});
  const Pose near{-1.2, 0, 0};
  const Pose far{-1.8, 0, 0};
  for (int k = 0; k < 4; ++k) {
    floor.add(near, with_gaps(scan_of(furnished(), near, 0.23), scan_of(walls(), near)));
  }
  ASSERT_FALSE(floor.is_free(edge));
  for (int k = 0; k < 60; ++k) {
    const Pose turned{near.x_m, near.y_m, 0.01 * k};
    floor.add(turned, with_gaps(scan_of(furnished(), turned, 0.23), scan_of(walls(), turned)));
  }
  EXPECT_FALSE(floor.is_free(edge));
  for (int k = 0; k < 60; ++k) floor.add(far, scan_of(walls(), far));
  EXPECT_FALSE(floor.is_free(edge)) << "it was never seen from there";
  for (int k = 0; k < 60; ++k) floor.add(near, scan_of(walls(), near));
  EXPECT_TRUE(floor.is_free(edge)) << "it has gone";
}

// Catches things that are placed by the wrong ranges of single beams, and near things that are not placed.
TEST(SeenFloor, WhatIsNearIsPlacedByManyBeamsAlone) {
  const Pose at{-0.2, 0, 0};
  for (const int beams : {3, 20}) {
    SeenFloor floor(walls(), lowest_seen_m);
    for (int k = 0; k < 5; ++k) floor.add(at, scan_of(walls(), at));
    std::vector<Beam> scan = scan_of(walls(), at);
    for (int k = 0; k < beams; ++k) scan[180 + std::size_t(k)] = {BeamState::kOccupied, 0.7, 0.01, 0.36};
    EXPECT_EQ(floor.add(at, scan).size(), beams == 20 ? 20U : 0U);
    EXPECT_EQ(floor.is_free(floor.cell_of({0.49, 0.02})), beams == 3);
  }
}

// Catches a thing that creeps, so that its front is always beside where it has just been seen.
TEST(SeenFloor, ReturnsWhatMovesSlowlyAgainWhereItWasBefore) {
  SeenFloor floor(walls(), lowest_seen_m);
  const Pose at{-1, 0, 0};
  for (int k = 0; k < 5; ++k) floor.add(at, scan_of(walls(), at));
  for (const int time : {1, 2}) {
    int seen = 0;
    for (int k = 0; k < 60; ++k) {
      Arena room = walls();
      room.discs.push_back({{1.2 - 0.1 * kStep_s * k, 0.1}, 0.17});
      seen += floor.add(at, scan_of(room, at)).empty() ? 0 : 1;
    }
    EXPECT_GE(seen, 40) << time;
  }
}

TEST(SeenFloor, ReturnsWhatComesOntoFloorThatWasFreeAndNotWhatStands) {
  SeenFloor floor(walls(), lowest_seen_m);
  const Pose at{-1, 0, 0};
  EXPECT_TRUE(floor.add(at, scan_of(walls(), at)).empty()) << "nothing was free before";
  for (int k = 0; k < 5; ++k) EXPECT_TRUE(floor.add(at, scan_of(walls(), at)).empty());
  const std::vector<Eigen::Vector2d> come_m = floor.add(at, scan_of(furnished(), at));
  EXPECT_GT(come_m.size(), 10U);
  for (const Eigen::Vector2d& place_m : come_m) EXPECT_NEAR(place_m.x(), 0.5, 0.05);
  for (int k = 0; k < 15; ++k) floor.add(at, scan_of(furnished(), at));
  EXPECT_TRUE(floor.add(at, scan_of(furnished(), at)).empty());
}

TEST(Explore, StandsUntilItSees) {
  Explore explore = explorer(walls());
  EXPECT_EQ(explore.decide({}, kStep_s).speed_mps, 0);
  double driven_m = 0;
  Pose pose;
  for (int k = 0; k < 20; ++k) {
    explore.see(pose, scan_of(walls(), pose));
    const Motion motion = explore.decide(pose, kStep_s);
    driven_m += kStep_s * std::abs(motion.speed_mps);
    pose = moved(pose, motion);
  }
  EXPECT_GT(driven_m, 0.3);
}

TEST(Explore, VisitsTheFloorAndTouchesNothingThatNoMapLists) {
  const Arena room = furnished();
  Explore explore = explorer(walls());
  Pose pose{-1, -0.5, 2};
  std::set<std::pair<int, int>> visited;
  for (int k = 0; k < 300; ++k) {
    explore.see(pose, scan_of(room, pose));
    pose = moved(pose, explore.decide(pose, kStep_s));
    ASSERT_GT(room.clearance_m({pose.x_m, pose.y_m}), kScout.radius_m) << "after " << k << " steps";
    visited.emplace(static_cast<int>(std::floor(2 * pose.x_m)), static_cast<int>(std::floor(2 * pose.y_m)));
  }
  // Of the squares of half a metre, those at the walls and in the box have no room for the robot's middle.
  EXPECT_GE(visited.size(), 18U);
}

TEST(Explore, NeverDrivesOntoFloorThatNoScanHasShown) {
  // Half of the room has no texture.
  const auto half_of = [](std::vector<Beam> scan, const Pose& at) {
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const double course_rad = at.heading_rad - std::numbers::pi + 2 * std::numbers::pi * (double(k) + 0.5) / 360;
      if (at.x_m + scan[k].range_m * std::cos(course_rad) > 0.5) scan[k] = {};
    }
    return scan;
  };
  Explore explore = explorer(walls());
  Pose pose{-1, 0, 0};
  double farthest_m = -1;
  for (int k = 0; k < 300; ++k) {
    explore.see(pose, half_of(scan_of(walls(), pose), pose));
    pose = moved(pose, explore.decide(pose, kStep_s));
    farthest_m = std::max(farthest_m, pose.x_m);
  }
  EXPECT_LT(farthest_m, 0.5 - kScout.radius_m);
  EXPECT_GT(farthest_m, -0.5);
}

TEST(Explore, StopsForWhatComesNear) {
  Explore explore = explorer(walls());
  Pose pose{-1.5, 0, 0};
  Motion motion;
  for (int k = 0; k < 40 && (std::abs(motion.speed_mps) < 0.2 || pose.x_m < -1.2); ++k) {
    explore.see(pose, scan_of(walls(), pose));
    motion = explore.decide(pose, kStep_s);
    pose = moved(pose, motion);
  }
  ASSERT_GT(std::abs(motion.speed_mps), 0.2);
  // Somebody steps into its way.
  Arena room = walls();
  const double forward = motion.speed_mps > 0 ? 1 : -1;
  const Eigen::Vector2d ahead(forward * std::cos(pose.heading_rad), forward * std::sin(pose.heading_rad));
  room.discs.push_back({{pose.x_m + 0.6 * ahead.x(), pose.y_m + 0.6 * ahead.y()}, 0.15});
  explore.see(pose, scan_of(room, pose));
  EXPECT_LE(forward * explore.decide(pose, kStep_s).speed_mps, 0);
}

// Catches a robot that waits, or drives, where something has passed and comes back.
TEST(Explore, KeepsOutOfTheWayOfWhatGoesToAndFro) {
  constexpr double kThing_m = 0.17;
  constexpr double kThing_mps = 0.2;
  Explore explore = explorer(walls());
  Pose pose{-1.5, 0, 0};
  double y_m = -1;
  double way_mps = kThing_mps;
  for (int k = 0; k < 300; ++k) {
    y_m += way_mps * kStep_s;
    if (std::abs(y_m) > 1) way_mps = std::copysign(kThing_mps, -y_m);
    Arena room = walls();
    room.discs.push_back({{0.3, y_m}, kThing_m});
    explore.see(pose, scan_of(room, pose));
    pose = moved(pose, explore.decide(pose, kStep_s));
    ASSERT_GT(room.clearance_m({pose.x_m, pose.y_m}), kScout.radius_m) << "after " << k << " steps";
  }
}

// Catches a robot that drives on in front of what comes from the side, until that is too near to be seen.
TEST(Explore, LeavesTheWayOfWhatComesFromTheSide) {
  for (const double from_y_m : {-1.2, 1.2}) {
    Explore explore = explorer(walls());
    Pose pose{-1.5, 0, 0};
    double y_m = from_y_m;
    for (int k = 0; k < 100; ++k) {
      y_m -= std::copysign(0.2, from_y_m) * kStep_s;
      Arena room = walls();
      room.discs.push_back({{0.0, y_m}, 0.17});
      std::vector<Beam> scan = scan_of(room, pose);
      for (Beam& beam : scan) {
        if (beam.range_m < 0.5) beam = {};
      }
      explore.see(pose, scan);
      pose = moved(pose, explore.decide(pose, kStep_s));
      if (std::abs(y_m) > 1.3) break;
      ASSERT_GT(room.clearance_m({pose.x_m, pose.y_m}), kScout.radius_m) << from_y_m << " after " << k << " steps";
    }
  }
}

// Catches turns of half a circle where the robot could drive backwards.
TEST(Explore, DrivesBackwardsToWhatIsBehindIt) {
  Explore explore = explorer(walls());
  Pose pose{1.5, 0, 0};
  double turned_rad = 0;
  double back_m = 0;
  for (int k = 0; k < 30; ++k) {
    explore.see(pose, scan_of(walls(), pose));
    const Motion motion = explore.decide(pose, kStep_s);
    back_m -= motion.speed_mps * kStep_s;
    turned_rad += std::abs(motion.turn_rate_radps) * kStep_s;
    pose = moved(pose, motion);
  }
  EXPECT_GT(back_m, 1);
  EXPECT_LT(turned_rad, 2.5);
}

TEST(Explore, DrivesAroundWhatStands) {
  // A passage beside a thing that closes the straight way.
  Arena room = walls();
  room.outlines.push_back({{-0.1, -1.5}, {0.1, -1.5}, {0.1, 0.7}, {-0.1, 0.7}});
  Explore explore = explorer(walls());
  Pose pose{-1, -0.8, 0};
  bool is_through = false;
  for (int k = 0; k < 400 && !is_through; ++k) {
    explore.see(pose, scan_of(room, pose));
    pose = moved(pose, explore.decide(pose, kStep_s));
    ASSERT_GT(room.clearance_m({pose.x_m, pose.y_m}), kScout.radius_m) << "after " << k << " steps";
    is_through = pose.x_m > 0.5;
  }
  EXPECT_TRUE(is_through);
}

}  // namespace
}  // namespace twocone::behaviours
