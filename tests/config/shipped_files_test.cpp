// SPDX-License-Identifier: Apache-2.0
// Checks the shipped files: each can be read, fits its map, and has its scene beside it.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "apps/behaviours/behaviour.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "drivers/backends.h"
#include "tests/config/fixtures.h"
#include "vision/hue_labels.h"

namespace twocone::config {
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
    EXPECT_GE(map.landmarks.size(), 3u) << "a position needs three landmarks";
  }
}

TEST(ShippedFiles, EveryDriverStandsWhereTheExplainedRobotFileSays) {
  const std::string robot = read_text(fs::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml");
  ASSERT_NE(robot.find("driver: sim_povray                # docs/drivers.md lists"), std::string::npos);
  const std::string list = read_text(fs::path(TWOCONE_SOURCE_DIR) / "docs/drivers.md");
  for (const drivers::Backend& backend : drivers::backends()) {
    if (backend.name == drivers::kSimPovray || backend.name == drivers::kMemory) continue;  // not for real robots
    EXPECT_NE(list.find(backend.name), std::string::npos) << backend.name;
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

/// A robot that users can build, by the name of its file. robots/NAME_sim.yaml is its simulated twin.
class RobotToBuild : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static Robot read(const std::string& ending) {
    return read_robot(fs::path(TWOCONE_SOURCE_DIR) / "robots" / (GetParam() + ending));
  }
};

INSTANTIATE_TEST_SUITE_P(Robots, RobotToBuild, testing::Values("usb_camera", "pi_csi", "create2"),
                         [](const auto& test) { return std::string(test.param); });

/// Returns the robot without the parts that may differ between the real and the simulated one: drivers with their
/// settings, map, start, and the wheels' calibrated sizes. (After a calibration the rig's numbers may differ too; none
/// ships.)
Robot without_differences(Robot robot) {
  robot.file.clear();
  robot.map.clear();
  robot.start.reset();
  robot.effects = {};
  robot.drive.driver.clear();
  robot.drive.serial.reset();
  robot.drive.wheel_separation_m = robot.drive.wheel_radius_m = 0;
  robot.drive.sigma.reset();
  robot.rig.sigma.reset();
  for (drivers::CameraPart* camera : {&robot.lower, &robot.upper}) {
    *camera = {.driver = {}, .settings = camera->settings};
  }
  return robot;
}

TEST_P(RobotToBuild, HasATwinThatDiffersWhereItMay) {
  const Robot real = read(".yaml");
  const Robot twin = read("_sim.yaml");
  for (const drivers::CameraPart* camera : {&twin.lower, &twin.upper}) EXPECT_EQ(camera->driver, "sim_povray");
  EXPECT_EQ(twin.drive.driver, "sim_povray");
  EXPECT_TRUE(without_differences(real) == without_differences(twin));
  EXPECT_EQ(twin.rig.sigma, RigSigma{}) << "it is exact by construction";
  EXPECT_FALSE(real.rig.sigma.has_value()) << "it is measured with a ruler";

  Map room = read_map(twin.map);
  const Map real_room = read_map(real.map);
  EXPECT_TRUE(room.scene.has_value());
  EXPECT_FALSE(real_room.scene.has_value());
  room.file = real_room.file;
  room.scene.reset();
  room.scene_paths.clear();
  EXPECT_TRUE(room.without_sigma.empty());
  room.without_sigma = real_room.without_sigma;
  for (std::size_t i = 0; i < room.landmarks.size(); ++i) room.landmarks[i].sigma = real_room.landmarks.at(i).sigma;
  EXPECT_TRUE(room == real_room) << "the simulated room must equal the measured one";
}

TEST_P(RobotToBuild, HasDevicesAndTimesThatSuitThem) {
  const Robot real = read(".yaml");
  for (const drivers::CameraPart* camera : {&real.lower, &real.upper}) {
    EXPECT_TRUE(camera->driver == "v4l2_camera" || camera->driver == "libcamera_camera") << camera->driver;
    EXPECT_FALSE(camera->device.controls.empty()) << "the exposure must not be automatic";
  }
  EXPECT_NE(real.lower.device.name, real.upper.device.name);
  ASSERT_TRUE(real.drive.serial.has_value());
  EXPECT_TRUE(real.drive.serial->port.starts_with("/dev/serial/by-id/")) << real.drive.serial->port;
  const double period_s = 1 / real.lower.settings.rate_hz;
  EXPECT_GE(real.max_skew_s, period_s / 2) << "two free-running cameras would have no pair";
  EXPECT_LT(real.max_skew_s, period_s);
  EXPECT_GE(real.drive.command_timeout_s, 4 * period_s) << "a late frame must not stop the wheels";
}

/// Returns the least clearance on the straight way between two points, in steps of a centimetre. Clearance changes by
/// at most the distance travelled, so the error is at most half a step.
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

/// The rooms for measurements of accuracy and for tests of robots before they are built, and the distance that their
/// waypoints keep from everything: the radius of the body and at least half as much again, because a controller that
/// looks ahead cuts corners.
struct Room {
  const char* robot;
  double clearance_m;

  friend void PrintTo(const Room& room, std::ostream* out) { *out << room.robot; }
};

class ShippedRoom : public testing::TestWithParam<Room> {};

INSTANTIATE_TEST_SUITE_P(Rooms, ShippedRoom,
                         testing::Values(Room{"lab_sim", 0.35}, Room{"hall_sim", 0.45}, Room{"workshop_sim", 0.25},
                                         Room{"usb_camera_sim", 0.35}, Room{"pi_csi_sim", 0.35},
                                         Room{"create2_sim", 0.35}, Room{"scout_sim", 0.32}),
                         [](const auto& test) { return std::string(test.param.robot); });

Robot robot_of(const Room& room) {
  return read_robot(fs::path(TWOCONE_SOURCE_DIR) / "robots" / (std::string(room.robot) + ".yaml"));
}

TEST_P(ShippedRoom, WaypointsKeepTheRobotClear) {
  const Robot robot = robot_of(GetParam());
  const behaviours::Arena arena = to_arena(read_map(robot.map));
  std::vector<Eigen::Vector2d> way = {{robot.start->x_m, robot.start->y_m}};
  for (const Point& point : robot.waypoints) way.emplace_back(point.x_m, point.y_m);
  ASSERT_GE(way.size(), 3u);
  way.push_back(way[1]);  // closes the loop, after the way to its start
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    EXPECT_GE(clearance_on_way_m(arena, way[i], way[i + 1]), GetParam().clearance_m)
        << "from (" << way[i].transpose() << ") to (" << way[i + 1].transpose() << ")";
  }
}

TEST_P(ShippedRoom, WanderingKeepsTheRobotClear) {
  // The believed pose is wrong by a slow circle, as after fixes: twice the paper's mean error.
  constexpr double kBeliefError_m = 0.06;
  constexpr int kFrames = 450;
  const Robot robot = robot_of(GetParam());
  const behaviours::Arena arena = to_arena(read_map(robot.map));
  const behaviours::Body body{robot.body_radius_m, robot.drive.max_speed_mps, robot.drive.wheel_separation_m};
  const double step_s = 1 / robot.lower.settings.rate_hz;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    behaviours::Wander wander(body, arena, seed);
    localisation::Pose pose = to_start_pose(robot);
    double least_m = arena.clearance_m({pose.x_m, pose.y_m});
    for (int i = 0; i < kFrames; ++i) {
      localisation::Pose believed = pose;
      believed.x_m += kBeliefError_m * std::cos(0.031 * i + static_cast<double>(seed));
      believed.y_m += kBeliefError_m * std::sin(0.031 * i + static_cast<double>(seed));
      const behaviours::Motion motion = wander.decide(believed, step_s);
      const double course_rad = pose.heading_rad + motion.turn_rate_radps * step_s / 2;
      pose.x_m += motion.speed_mps * step_s * std::cos(course_rad);
      pose.y_m += motion.speed_mps * step_s * std::sin(course_rad);
      pose.heading_rad = localisation::wrap_angle_rad(pose.heading_rad + motion.turn_rate_radps * step_s);
      least_m = std::min(least_m, arena.clearance_m({pose.x_m, pose.y_m}));
    }
    EXPECT_GT(least_m, robot.body_radius_m) << "seed " << seed << ", metres";
  }
}

TEST_P(ShippedRoom, ColoursAreFarApart) {
  // Twice the window in which vision assigns a hue to a landmark (vision/hue_labels.h).
  constexpr double kLeast_rad = 2 * vision::HueLabels::kHueWindow_rad;
  // The angle about the grey axis. The hexagonal hue of the vision differs from it by 1.1 degrees at most.
  const auto hue_rad = [](const std::array<double, 3>& c) {
    return std::atan2(std::sqrt(3.0) * (c[1] - c[2]), 2 * c[0] - c[1] - c[2]);
  };
  const Map map = read_map(robot_of(GetParam()).map);
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double apart_rad = std::abs(
          std::remainder(hue_rad(map.landmarks[i].colour) - hue_rad(map.landmarks[j].colour), 2 * std::numbers::pi));
      EXPECT_GE(apart_rad, kLeast_rad) << map.landmarks[i].name << " and " << map.landmarks[j].name << ", rad";
    }
  }
}

}  // namespace
}  // namespace twocone::config
