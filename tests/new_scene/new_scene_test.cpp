// SPDX-License-Identifier: Apache-2.0
#include "apps/new_scene/new_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <variant>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "tests/support/temporary_folder.h"

namespace twocone::new_scene {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

const std::filesystem::path kScenes = std::filesystem::path(TWOCONE_SOURCE_DIR) / "scenes";
constexpr double kMillimetre = 1e-3;

/// A floor of 6 m, seen by a camera 1.5 m above it.
constexpr const char* kFloor =
    "#version 3.7;\n"
    "// 1 POV-Ray unit = 10 cm\n"
    "camera { location <0, 12, -28> look_at <0, -3, 0> }\n"
    "box { <-30, -4, -30> <30, -3, 30> pigment { rgb 0.5 } }\n";

class NewScene : public testing::Test {
 protected:
  Room room_of(const std::string& text, std::optional<double> unit_m = {}) const {
    return find_room({.scene = folder.write("s.pov", text), .unit_m = unit_m});
  }
  std::string refusal_of(const std::string& text, std::optional<double> unit_m = {}) const {
    try {
      (void)room_of(text, unit_m);
    } catch (const NoPlace& error) {
      return error.what();
    }
    return "";
  }

  testing_support::TemporaryFolder folder;
};

bool is_within(const config::Obstacle& obstacle, double x_m, double y_m) {
  if (const auto* disc = std::get_if<Disc>(&obstacle)) {
    return std::hypot(x_m - disc->centre.x_m, y_m - disc->centre.y_m) <= disc->radius_m + 1e-9;
  }
  const auto& corners = std::get<config::Polygon>(obstacle);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& a = corners[i];
    const auto& b = corners[(i + 1) % corners.size()];
    if ((b.x_m - a.x_m) * (y_m - a.y_m) - (b.y_m - a.y_m) * (x_m - a.x_m) < -1e-9) return false;
  }
  return true;
}

bool is_obstacle(const Room& room, double x_m, double y_m) {
  return std::ranges::any_of(room.obstacles, [&](const auto& found) { return is_within(found.corners, x_m, y_m); });
}

std::vector<std::string> names(const Room& room, bool are_added) {
  std::vector<std::string> result;
  for (const FoundLandmark& found : room.landmarks) {
    if (found.place.empty() == are_added) result.push_back(found.landmark.name);
  }
  return result;
}

TEST_F(NewScene, TheLabsLandmarksAreFoundWithoutItsMap) {
  std::ifstream lab(kScenes / "lab.pov");
  std::stringstream text;
  text << lab.rdbuf();
  const Room room = room_of(text.str());
  const config::Map map = config::read_map(kScenes / "lab.map.yaml");
  EXPECT_EQ(room.floor.unit_m, map.unit_m) << "a comment of the scene states it";
  EXPECT_THAT(names(room, true), IsEmpty());
  ASSERT_EQ(room.landmarks.size(), map.landmarks.size());
  for (const Landmark& wanted : map.landmarks) {
    const auto found = std::ranges::find(room.landmarks, wanted.name, [](const auto& f) { return f.landmark.name; });
    ASSERT_NE(found, room.landmarks.end()) << wanted.name;
    EXPECT_LT(std::hypot(found->landmark.x_m - wanted.x_m, found->landmark.y_m - wanted.y_m), kMillimetre);
    EXPECT_NEAR(found->landmark.radius_m, wanted.radius_m, kMillimetre);
    EXPECT_NEAR(found->landmark.top_m, wanted.top_m, kMillimetre);
    EXPECT_EQ(found->landmark.colour, wanted.colour);
    EXPECT_THAT(found->place, HasSubstr("s.pov:163")) << "the line in the macro";
  }
  // Obstacles of the map stand on the floor. Cells of 5 cm on each side make them larger.
  for (const config::Obstacle& obstacle : map.obstacles) {
    EXPECT_FALSE(is_within(obstacle, room.start.x_m, room.start.y_m));
    if (const auto* polygon = std::get_if<config::Polygon>(&obstacle)) {
      FloorPoint middle;
      for (const FloorPoint& p : *polygon) {
        middle.x_m += p.x_m / double(polygon->size());
        middle.y_m += p.y_m / double(polygon->size());
      }
      EXPECT_TRUE(is_obstacle(room, middle.x_m, middle.y_m)) << middle.x_m << ", " << middle.y_m;
    }
  }
  constexpr double kCell_m = 0.05;
  EXPECT_NEAR(room.bounds.min_x_m, map.bounds.min_x_m, 2 * kCell_m);
  EXPECT_NEAR(room.bounds.max_y_m, map.bounds.max_y_m, 2 * kCell_m);
}

TEST_F(NewScene, FindsCylindersThatVisionCanUse) {
  const auto post = [](double x, double z, const char* rest) {
    return fmt::format("cylinder {{ <{0}, -3, {1}> <{0}, 6.5, {1}> 1.2 {2} }}\n", x, z, rest);
  };
  const Room room = room_of(std::string(kFloor) + post(15, 3, "pigment { rgb <0.9, 0.02, 0.02> }") +
                            post(-12, 11, "pigment { rgb <0.05, 0.05, 0.7> }") +
                            post(-9, -14, "texture { pigment { rgb <0, 0.6, 0> } finish { phong 1 } }") +
                            post(4, 20, "pigment { rgb <0.7, 0.7, 0.01> }") +
                            post(20, -15, "pigment { rgb <0.7, 0.65, 0.01> }") +           // of the same hue
                            post(-20, 0, "pigment { rgb <0.5, 0.3, 0.5> }") +              // pale
                            post(10, -18, "pigment { rgb <0, 0.6, 0.6> } rotate 0.5*x") +  // leans
                            "cylinder { <-20, -3, -20> <-20, 0, -20> 1 pigment { rgb <0.8, 0, 0.8> } }\n");  // low
  EXPECT_THAT(names(room, false), UnorderedElementsAre("red", "blue", "green"));
  EXPECT_THAT(names(room, true), IsEmpty());
  const auto& red = *std::ranges::find(room.landmarks, "red", [](const auto& f) { return f.landmark.name; });
  EXPECT_NEAR(red.landmark.x_m, 1.5, kMillimetre);
  EXPECT_NEAR(red.landmark.y_m, 0.3, kMillimetre);
  EXPECT_NEAR(red.landmark.radius_m, 0.12, kMillimetre);
  EXPECT_NEAR(red.landmark.top_m, 0.95, kMillimetre) << "above the floor at y = -3";
  EXPECT_THAT(room.warnings, testing::Contains(HasSubstr("another cylinder has its hue, yellow")));
}

TEST_F(NewScene, EveryPointOfAnObjectLiesInAnObstacle) {
  const Room room = room_of(std::string(kFloor) +
                            "box { <-3, 0, -1.3> <3, 9, 1.3> rotate 23*y translate <-9, -3, 8> }\n"
                            "sphere { <10, -1, 9>, 3 }\n"
                            "torus { 3, 0.4 rotate 90*x translate <8, 0, -12> }\n"
                            "box { <-20, 1.2, -20> <-12, 1.5, -12> }\n"                       // a table's top
                            "box { <-0.05, -3, -6> <0.05, 3, 6> rotate 45*y }\n"              // a thin wall
                            "cylinder { <20, -3, 0> <20, 3, 0> 0.05 }\n"                      // a stick
                            "box { <18, 6, 16> <25, 8, 25> }\n"                               // above the robot
                            "box { <-28, -3.05, 16> <-18, -2.9, 25> pigment { rgb 1 } }\n");  // a carpet, 1 cm high
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr double kTurn = 23 * std::numbers::pi / 180;
  for (int i = 0; i < 500; ++i) {
    const double u = unit(random), v = unit(random);
    const double x = 3 * u, z = 1.3 * v;  // POV-Ray turns x towards -z
    EXPECT_TRUE(is_obstacle(room, 0.1 * (x * std::cos(kTurn) + z * std::sin(kTurn) - 9),
                            0.1 * (-x * std::sin(kTurn) + z * std::cos(kTurn) + 8)))
        << "box " << u << ", " << v;
    const double angle = std::numbers::pi * u, r = 3 * std::sqrt(std::abs(v));
    EXPECT_TRUE(is_obstacle(room, 0.1 * (10 + r * std::cos(angle)), 0.1 * (9 + r * std::sin(angle)))) << "sphere";
    EXPECT_TRUE(is_obstacle(room, 0.1 * (8 + 3.3 * u), 0.1 * (-12 + 0.1 * v))) << "torus";
    EXPECT_TRUE(is_obstacle(room, 0.1 * (-16 + 4 * u), 0.1 * (-16 + 4 * v))) << "table";
    EXPECT_TRUE(is_obstacle(room, 0.1 * 6 * u * std::sqrt(0.5), 0.1 * 6 * u * std::sqrt(0.5))) << "wall " << u;
  }
  EXPECT_TRUE(is_obstacle(room, 2, 0)) << "stick";
  EXPECT_FALSE(is_obstacle(room, 2.1, 2)) << "what hangs above the robot";
  EXPECT_FALSE(is_obstacle(room, -2.3, 2)) << "a carpet";
  EXPECT_FALSE(is_obstacle(room, room.start.x_m, room.start.y_m));
}

TEST_F(NewScene, AddsLandmarksInHuesThatTheSceneDoesNotHold) {
  const Room room = room_of(std::string(kFloor) +
                            "sphere { <10, 0, 9>, 3 pigment { rgb <0.8, 0.1, 0.1> } }\n"
                            "box { <-20, -3, 0> <-16, 2, 4> pigment { rgb <0, 0.4, 0> } }\n");
  EXPECT_THAT(names(room, false), IsEmpty());
  const auto added = names(room, true);
  EXPECT_GE(added.size(), 3U);
  EXPECT_THAT(added, testing::Not(testing::Contains("red")));
  EXPECT_THAT(added, testing::Not(testing::Contains("green")));
  EXPECT_THAT(room.warnings, IsEmpty());
  for (const FoundLandmark& found : room.landmarks) {
    EXPECT_FALSE(is_obstacle(room, found.landmark.x_m, found.landmark.y_m)) << found.landmark.name;
    EXPECT_LE(found.landmark.x_m, room.bounds.max_x_m);
    EXPECT_GE(found.landmark.y_m, room.bounds.min_y_m);
  }
}

TEST_F(NewScene, TheUnitIsGivenStatedOrEstimated) {
  const std::string text = kFloor;
  EXPECT_EQ(room_of(text).floor.unit_m, 0.1) << "stated";
  EXPECT_THAT(room_of(text).floor.why_unit, HasSubstr("s.pov:2"));
  EXPECT_EQ(room_of(text, 0.07).floor.unit_m, 0.07);
  std::string silent = text;
  silent.replace(silent.find("10 cm"), 5, "     ");
  EXPECT_EQ(room_of(silent).floor.unit_m, 0.1) << "a camera 15 units above the floor";
  EXPECT_THAT(room_of(silent).floor.why_unit, HasSubstr("--unit-m"));
  EXPECT_EQ(room_of(silent).floor.units, -3);
}

TEST_F(NewScene, WhatItWritesIsRead) {
  const Room room = room_of(std::string(kFloor) + "sphere { <10, -1, 9>, 3 pigment { rgb 1 } }");
  const RoomSettings settings{.scene = room.scene};
  const NewFiles files = files_for("some/a b.pov", folder.path() / "new");
  EXPECT_EQ(files.robot, folder.path() / "new" / "a_b.yaml");
  write_files(room, settings, files);
  const config::Robot robot = config::read_robot(files.robot);
  EXPECT_NEAR(robot.start.value().x_m, room.start.x_m, 1e-6);
  const config::Map map = config::read_map(robot.map);
  EXPECT_EQ(map.unit_m, room.floor.unit_m);
  ASSERT_EQ(map.landmarks.size(), room.landmarks.size());
  EXPECT_NEAR(map.landmarks[0].x_m, room.landmarks[0].landmark.x_m, 1e-6);
  EXPECT_EQ(map.obstacles.size(), room.obstacles.size());
  EXPECT_EQ(*map.scene, files.wrapper);
}

TEST_F(NewScene, OneLineSaysWhyThereIsNoPlace) {
  EXPECT_THAT(refusal_of("sphere { 0, 1 } camera { location -5*z look_at 0 }"), HasSubstr("no floor was found"));
  EXPECT_THAT(refusal_of("quartic { <1, 2> }"), HasSubstr("no shape of it was understood"));
  EXPECT_THAT(refusal_of(kFloor, 0.001), HasSubstr("has no room for a robot of 0.2 m radius"));
  EXPECT_THAT(refusal_of("plane { z, 0 } camera { location <3, 3, 2> sky z look_at 0 right x }"), HasSubstr("y is up"));
  EXPECT_THAT(refusal_of("box { -1, 1"), HasSubstr("s.pov:1"));
}

}  // namespace
}  // namespace twocone::new_scene
