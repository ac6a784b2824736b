// SPDX-License-Identifier: Apache-2.0
// The files that ship: each can be read, fits its map, and has its scene beside it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "apps/files/to_layers.h"
#include "tests/files/fixtures.h"

namespace twocone::files {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_in(const std::string& folder, const std::string& ending) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(TWOCONE_SOURCE_DIR) / folder)) {
    if (entry.path().filename().string().ends_with(ending)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(ShippedFiles, EveryMapCanBeReadAndHasItsScene) {
  const std::vector<fs::path> maps = files_in("scenes", ".map.yaml");
  ASSERT_FALSE(maps.empty());
  for (const fs::path& file : maps) {
    SCOPED_TRACE(file);
    ASSERT_NO_THROW(read_map(file));
    const Map map = read_map(file);
    if (map.scene) {
      EXPECT_TRUE(fs::is_regular_file(*map.scene)) << *map.scene;
    }
    EXPECT_GE(map.landmarks.size(), 3u) << "a position needs three";
  }
}

TEST(ShippedFiles, EveryRobotCanBeReadAndFitsItsMap) {
  const std::vector<fs::path> robots = files_in("robots", ".yaml");
  ASSERT_FALSE(robots.empty());
  for (const fs::path& file : robots) {
    SCOPED_TRACE(file);
    ASSERT_NO_THROW(to_rig(read_robot(file)));
    const Robot robot = read_robot(file);
    ASSERT_NO_THROW(to_robot_settings(robot, read_map(robot.map), 1));
  }
}

/// The least clearance on the straight way between two points, to a centimetre's step: clearance changes by at most
/// the way, so that half a step is the most that can be missed.
double clearance_on_way_m(const behaviours::Arena& arena, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr double kStep_m = 0.01;
  const int steps = static_cast<int>(std::ceil((to - from).norm() / kStep_m)) + 1;
  double least_m = arena.clearance_m(from);
  for (int i = 1; i <= steps; ++i) {
    const double part = static_cast<double>(i) / steps;
    least_m = std::min(least_m, arena.clearance_m(from + part * (to - from)));
  }
  return least_m - kStep_m / 2;
}

TEST(ShippedFiles, TheLabsWaypointsKeepTheRobotClear) {
  // The body's 0.2 m and as much again less a hand's breadth, for corners cut by a controller that looks ahead.
  constexpr double kClearance_m = 0.35;
  const Robot robot = read_robot(fs::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml");
  const behaviours::Arena arena = to_arena(read_map(robot.map));
  std::vector<Eigen::Vector2d> way = {{robot.start->x_m, robot.start->y_m}};
  for (const Point& point : robot.waypoints) way.emplace_back(point.x_m, point.y_m);
  ASSERT_GE(way.size(), 4u);
  way.push_back(way[1]);  // the loop is closed, after the way to its beginning
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    EXPECT_GE(clearance_on_way_m(arena, way[i], way[i + 1]), kClearance_m)
        << "from (" << way[i].transpose() << ") to (" << way[i + 1].transpose() << ")";
  }
}

}  // namespace
}  // namespace twocone::files
