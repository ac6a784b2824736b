// SPDX-License-Identifier: Apache-2.0
#include "apps/look/look.h"

#include <algorithm>
#include <functional>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/look/checks.h"
#include "tests/support/lab_robot.h"
#include "tests/support/temporary_folder.h"
#include "vision/bands/band_code.h"

namespace twocone::look {

void PrintTo(Disagreement kind, std::ostream* out) { *out << "disagreement " << int(kind); }

namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// A room with five landmarks, a crate, a table that is partly over the robot's mirrors, and a low sill. 1 unit is 0.05
/// m. The map below has all of it but the sill, which is lower than what maps have.
constexpr const char* kScene = R"(#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 4 }
#default { finish { ambient 0.4 diffuse 0.6 } }
background { color rgb 0.7 }
light_source { <0, 44, 0> color rgb 0.8 shadowless }
box { <-45, -1, -35> <45, 0, 35> pigment { color rgb 0.5 } }
box { <-46, -1, 35> <46, 48, 36> pigment { color rgb 0.7 } }
box { <-46, -1, -36> <46, 48, -35> pigment { color rgb 0.6 } }
box { <45, -1, -35> <46, 48, 35> pigment { color rgb 0.65 } }
box { <-46, -1, -35> <-45, 48, 35> pigment { color rgb 0.55 } }
box { <-45, 48, -35> <45, 49, 35> pigment { color rgb 0.8 } }
cylinder { <36, 0, 5> <36, 18, 5> 2.2 pigment { color rgb <0.80, 0.03, 0.03> } }
cylinder { <14, 0, 28> <14, 18, 28> 2.2 pigment { color rgb <0.60, 0.80, 0.03> } }
cylinder { <-27, 0, 25> <-27, 18, 25> 2.2 pigment { color rgb <0.03, 0.80, 0.40> } }
cylinder { <-30, 0, -21> <-30, 18, -21> 2.2 pigment { color rgb <0.03, 0.20, 0.80> } }
cylinder { <13, 0, -27> <13, 18, -27> 2.2 pigment { color rgb <0.75, 0.03, 0.80> } }
box { <16, 0, -13> <24, 6, -6> pigment { color rgb 0.3 } }
box { <-45, 14, -5> <-33, 15, 8> pigment { color rgb 0.4 } }
box { <-36, 0, 5> <-35, 14, 6> pigment { color rgb 0.4 } }
box { <-10, 0, 14> <-2, 0.35, 16> pigment { color rgb 0.4 } }
#declare Mirror = cone { <0, 0, 0>, 0 <0, 1.2, 0>, 1.2
  pigment { color rgb 0 } finish { ambient 0 diffuse 0 reflection 1 } }
union {
  //*PMName robot
  cylinder { <0, 0.2, 0> <0, 3, 0> 3 pigment { color rgb 0.2 } }
  object { Mirror translate <0, 7.4, 0> }
  object { Mirror translate <0, 13.4, 0> }
}
camera {
  //*PMName lower
  location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  location <0, 11, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
)";

constexpr const char* kMap = R"(scene: room.pov
unit_m: 0.05
bounds_m: {x: [-2.25, 2.25], y: [-1.75, 1.75]}
landmarks:
  - {name: red,     colour: [0.80, 0.03, 0.03], x_m: 1.80, y_m: 0.25, radius_m: 0.11, top_m: 0.9}
  - {name: lime,    colour: [0.60, 0.80, 0.03], x_m: 0.70, y_m: 1.40, radius_m: 0.11, top_m: 0.9}
  - {name: jade,    colour: [0.03, 0.80, 0.40], x_m: -1.35, y_m: 1.25, radius_m: 0.11, top_m: 0.9}
  - {name: blue,    colour: [0.03, 0.20, 0.80], x_m: -1.50, y_m: -1.05, radius_m: 0.11, top_m: 0.9}
  - {name: magenta, colour: [0.75, 0.03, 0.80], x_m: 0.65, y_m: -1.35, radius_m: 0.11, top_m: 0.9}
obstacles:
  - {polygon_m: [[0.8, -0.65], [1.2, -0.65], [1.2, -0.3], [0.8, -0.3]]}
  - {polygon_m: [[-2.25, -0.25], [-1.65, -0.25], [-1.65, 0.4], [-2.25, 0.4]]}
)";

/// Returns `text` with its first `from` replaced. @throws std::invalid_argument if there is none
std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::invalid_argument("no '" + from + "'");
  return text.replace(at, from.size(), to);
}

/// A scene and a map in a folder, and what the checks of the geometry find.
class Room {
 public:
  explicit Room(const std::string& scene = kScene, const std::string& map = kMap) {
    static_cast<void>(folder_.write("room.pov", scene));
    map_ = config::read_map(folder_.write("room.map.yaml", map));
    robot_ = testing_support::with_images(testing_support::lab_robot(), 320, 240, 118);
    robot_.start = Pose2{};
  }

  config::Robot& robot() { return robot_; }
  [[nodiscard]] const config::Map& map() const { return map_; }

  [[nodiscard]] sim_povray::SceneGeometry geometry() const {
    auto read = sim_povray::SceneGeometry::read(config::to_place(map_));
    if (!read) throw std::runtime_error(read.error().message);
    return *std::move(read);
  }
  [[nodiscard]] Look looked_at() const {
    const sim_povray::SceneGeometry scene = geometry();
    const sim_povray::KeyPlaces places{{"map.landmarks[0]", "room.map.yaml:5"},
                                       {"map.obstacles[0]", "room.map.yaml:11"}};
    const Subject subject{robot_, map_, places};
    Look look;
    check_start(subject, look);
    check_floor(subject, scene, look);
    check_landmarks(subject, scene, look);
    check_obstacles(subject, scene, look);
    return look;
  }

 private:
  testing_support::TemporaryFolder folder_;
  config::Map map_;
  config::Robot robot_;
};

std::vector<Disagreement> kinds(const Look& look) {
  std::vector<Disagreement> found;
  for (const Finding& finding : look.findings) found.push_back(finding.kind);
  return found;
}

std::string lines_of(const Look& look) {
  std::string text;
  for (const Finding& finding : look.findings) text += finding.text + "\n";
  return text;
}

TEST(Look, WhatAgreesIsNoFinding) {
  const Look look = Room().looked_at();
  EXPECT_THAT(kinds(look), IsEmpty()) << lines_of(look);
  EXPECT_THAT(look.checked, SizeIs(4));
  EXPECT_THAT(look.uncovered, IsEmpty());
}

/// Returns the scene with bands of a number at the red landmark's upper end.
std::string scene_with_bands(int number) {
  const vision::BandCells cells = vision::band_cells(number);
  const double cell = Bands{}.cell_m / 0.9;
  std::string stops = "[0 rgb 0.4]";
  for (std::size_t k = cells.size(); k-- > 0;) {
    for (const double below : {double(k) + 1, double(k)}) {
      stops += fmt::format(" [{} rgb {}]", 1 - below * cell, cells[k] ? 0.8 : 0.05);
    }
  }
  return with(kScene, "2.2 pigment { color rgb <0.80, 0.03, 0.03> }",
              fmt::format("2.2 pigment {{ gradient y color_map {{ {} }} scale 18 }}", stops));
}

TEST(Look, BandsAreReadInTheScene) {
  const std::string map = with(kMap, "colour: [0.80, 0.03, 0.03], x_m: 1.80, y_m: 0.25, radius_m: 0.11, top_m: 0.9",
                               "bands: 9, x_m: 1.80, y_m: 0.25, radius_m: 0.11, line_m: 0.798");
  const Look agrees = Room(scene_with_bands(9), map).looked_at();
  EXPECT_THAT(kinds(agrees), IsEmpty()) << lines_of(agrees);
  const Look differs = Room(scene_with_bands(10), map).looked_at();
  ASSERT_THAT(kinds(differs), ElementsAre(Disagreement::kLandmarkColour)) << lines_of(differs);
  EXPECT_THAT(differs.findings[0].text, HasSubstr("has bands 9 with their line at 0.798 m, but"));
  EXPECT_THAT(differs.findings[0].text, HasSubstr("has bands 10 there"));
}

// ---- one planted disagreement each: it is named, and nothing else is

struct Planted {
  const char* name;
  Disagreement kind;
  const char* in_scene;  ///< part of the scene that is replaced; empty: none
  const char* scene_becomes;
  const char* in_map;
  const char* map_becomes;
  const char* text;  ///< part of the finding
};

void PrintTo(const Planted& planted, std::ostream* out) { *out << planted.name; }

class LookPlanted : public testing::TestWithParam<Planted> {};

TEST_P(LookPlanted, IsTheOnlyFinding) {
  const Planted& p = GetParam();
  const Look look = Room(with(kScene, p.in_scene, p.scene_becomes), with(kMap, p.in_map, p.map_becomes)).looked_at();
  ASSERT_THAT(kinds(look), ElementsAre(p.kind)) << lines_of(look);
  EXPECT_THAT(look.findings[0].text, HasSubstr(p.text));
  EXPECT_EQ(look.findings[0].text.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Each, LookPlanted,
    testing::Values(
        Planted{"LandmarkMoved30mm", Disagreement::kLandmarkPlace, "", "", "x_m: 1.80, y_m: 0.25",
                "x_m: 1.80, y_m: 0.28", "room.map.yaml:5: landmark red is at (1.800, 0.280), but cylinder of"},
        Planted{"LandmarkMoved2mm", Disagreement::kLandmarkPlace, "", "", "x_m: 1.80, y_m: 0.25",
                "x_m: 1.802, y_m: 0.25", "at (1.800, 0.250): 2.0 mm apart"},
        Planted{"LandmarkMovedByMoreThanItsRadius", Disagreement::kLandmarkMissing, "", "", "x_m: 0.70, y_m: 1.40",
                "x_m: 0.20, y_m: 1.40", "is 0.500 m away at (0.700, 1.400), with radius 0.110 and top 0.900"},
        Planted{"LandmarkNotInTheScene", Disagreement::kLandmarkMissing,
                "cylinder { <36, 0, 5> <36, 18, 5> 2.2 pigment { color rgb <0.80, 0.03, 0.03> } }", "", "", "",
                "landmark red: nothing stands around (1.800, 0.250) in the scene; the scene has no upright cylinder"},
        Planted{"Radius", Disagreement::kLandmarkRadius, "", "", "radius_m: 0.11", "radius_m: 0.12",
                "landmark red has radius_m 0.120, but"},
        Planted{"ABoxIsNoCylinder", Disagreement::kLandmarkRadius, "cylinder { <36, 0, 5> <36, 18, 5> 2.2",
                "box { <33.8, 0, 2.8> <38.2, 18, 7.2>", "", "", "is no upright cylinder"},
        Planted{"ALeaningCylinder", Disagreement::kLandmarkRadius, "<36, 18, 5> 2.2", "<36.2, 18, 5> 2.2", "", "",
                "is no upright cylinder"},
        Planted{"Top", Disagreement::kLandmarkTop, "", "", "top_m: 0.9", "top_m: 0.92",
                "landmark red has top_m 0.920, but"},
        Planted{"TopOfAnOpenCylinder", Disagreement::kLandmarkTop, "<36, 18, 5> 2.2", "<36, 17, 5> 2.2 open", "", "",
                "ends at 0.8500"},
        Planted{"Colour", Disagreement::kLandmarkColour, "", "", "colour: [0.80, 0.03, 0.03]",
                "colour: [0.80, 0.15, 0.03]", "landmark red has colour [0.8, 0.15, 0.03], but"},
        Planted{"Grey", Disagreement::kLandmarkColour, "color rgb <0.80, 0.03, 0.03>", "color rgb <0.80, 0.5, 0.5>", "",
                "", "too grey for a landmark"},
        Planted{"ForgottenObstacle", Disagreement::kNotOnMap, "", "",
                "  - {polygon_m: [[0.8, -0.65], [1.2, -0.65], [1.2, -0.3], [0.8, -0.3]]}\n", "",
                "room.pov:17: box at x 0.79 to 1.21, y -0.67 to -0.29, up to 0.30 m high: no obstacle of"},
        Planted{"ForgottenTallThing", Disagreement::kNotOnMap, "box { <16, 0, -13>",
                "box { <2, 0, 24> <4, 40, 26> pigment { color rgb 0.3 } } box { <16, 0, -13>", "", "",
                "0.73 m or more high"},
        Planted{"ThinPost", Disagreement::kNotOnMap, "box { <16, 0, -13>",
                "cylinder { <3, 0, 25> <3, 40, 25> 0.4 pigment { color rgb 0.3 } } box { <16, 0, -13>", "", "",
                "room.pov:17: cylinder at x 0.1"},
        Planted{"ObstacleThatIsNotThere", Disagreement::kNotInScene, "", "", "obstacles:\n",
                "obstacles:\n  - {circle_m: {x: 0.1, y: 0.9, radius: 0.1}}\n",
                "room.map.yaml:11: obstacle 1 around (0.10, 0.90): the scene has nothing there from 0.02 to 1.15 m"},
        Planted{"FloorTooHigh", Disagreement::kFloor, "<-45, -1, -35> <45, 0, 35>", "<-45, -1, -35> <45, 0.1, 35>", "",
                "", "is at 0.0050 m, must be at 0"},
        Planted{"NoFloor", Disagreement::kFloor, "box { <-45, -1, -35> <45, 0, 35> pigment { color rgb 0.5 } }", "", "",
                "", "there is no floor under the start"}),
    [](const auto& row) { return std::string(row.param.name); });

TEST(Look, AStartThatTouchesAnObstacleIsTheOnlyFinding) {
  Room room;
  room.robot().start = Pose2{0.7, -0.5, 0.3};  // 0.1 m from the crate
  const Look look = room.looked_at();
  ASSERT_THAT(kinds(look), ElementsAre(Disagreement::kStartTouches)) << lines_of(look);
  EXPECT_THAT(look.findings[0].text,
              AllOf(HasSubstr("start (0.700, -0.500) is 0.100 m from obstacle 1 (room.map.yaml:11)"),
                    HasSubstr("body.radius_m is 0.2")));
  room.robot().start = Pose2{1.0, -0.5, 0.3};
  EXPECT_THAT(lines_of(room.looked_at()), HasSubstr("is in obstacle 1"));
}

/// A box around everything, as authors make rooms: its inside is air and no obstacle.
TEST(Look, ABoxThatIsTheRoomIsNoObstacle) {
  const Look look = Room(with(kScene, "box { <-45, 48,",
                              "box { <-45.5, -0.5, -35.5> <45.5, 48, 35.5> pigment { color rgb 1 } } box { <-45, 48,"))
                        .looked_at();
  EXPECT_THAT(kinds(look), IsEmpty()) << lines_of(look);
}

TEST(Look, TheRobotAndMovingThingsAreNoObstacles) {
  const Look look =
      Room(with(kScene, "box { <16, 0, -13>",
                "sphere { //*PMName moving.ball\n <0, 4, 20>, 3 pigment { color rgb 1 } } box { <16, 0, -13>"))
          .looked_at();
  EXPECT_THAT(kinds(look), IsEmpty()) << lines_of(look);
}

TEST(Look, AMapOnlyComparesWhatTheSceneShowsInMirrors) {
  const Look look = Room(with(kScene, "box { <16, 0, -13>",
                              "box { <0, 0, 20> <4, 6, 24> pigment { color rgb 1 } no_reflection } box { <16, 0, -13>"))
                        .looked_at();
  EXPECT_THAT(kinds(look), IsEmpty()) << lines_of(look);
}

// ---- with images

/// Writes a robot file for the room and returns what look() says.
Result<Look> look_at(const std::string& map, const testing_support::TemporaryFolder& folder,
                     const std::string& rim_radius_px = "118.0", const std::string& scene = kScene) {
  static_cast<void>(folder.write("room.pov", scene));
  static_cast<void>(folder.write("room.map.yaml", map));
  const config::Robot robot = config::read_robot(folder.write("robot.yaml", fmt::format(R"(name: lab
map: room.map.yaml
start: {{x_m: 0.0, y_m: 0.0, heading_rad: 0.0}}
body: {{radius_m: 0.2}}
drive: {{driver: sim_povray, wheel_separation_m: 0.30, wheel_radius_m: 0.05, max_speed_mps: 0.5}}
cameras:
  lower: {{driver: sim_povray, width_px: 320, height_px: 240, rate_hz: 15}}
  upper: {{driver: sim_povray, width_px: 320, height_px: 240, rate_hz: 15}}
rig:
  mirror: {{type: cone, apex_rad: 1.5707963267948966}}
  mirror_radius_m: 0.06
  lens_to_tip_m: 0.12
  mirror_separation_m: 0.30
  lens_height_m: 0.25
  sigma: 0
  lower: {{centre_px: [159.5, 119.5], rim_radius_px: {0}, azimuth_rad: 0.0}}
  upper: {{centre_px: [159.5, 119.5], rim_radius_px: {0}, azimuth_rad: 0.0}}
)",
                                                                                        rim_radius_px)));
  return look(robot, config::read_map(robot.map), {.out = folder.path() / "out"});
}

TEST(LookImages, ARobotThatAgreesHasItsFilesAndNoFinding) {
  const testing_support::TemporaryFolder folder;
  const auto seen = look_at(kMap, folder);
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_THAT(kinds(*seen), IsEmpty()) << lines_of(*seen);
  EXPECT_THAT(seen->checked, SizeIs(7)) << "start, its place, floor, landmarks, obstacles, rims, sightings";
  ASSERT_THAT(seen->files, SizeIs(3));
  for (const std::filesystem::path& file : seen->files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_THAT(folder.read("out/above.svg"), AllOf(HasSubstr("no disagreement found"), HasSubstr(">magenta</text>")));
}

TEST(LookImages, ALandmarkThatIsElsewhereIsNamedOnceAndDrawn) {
  const testing_support::TemporaryFolder folder;
  const auto seen = look_at(with(kMap, "x_m: 1.80, y_m: 0.25", "x_m: 1.72, y_m: 0.25"), folder);
  ASSERT_TRUE(seen) << seen.error().message;
  ASSERT_THAT(kinds(*seen), ElementsAre(Disagreement::kLandmarkPlace)) << lines_of(*seen);
  EXPECT_THAT(seen->findings[0].text, HasSubstr("room.map.yaml:5: landmark red is at (1.720, 0.250)"));
  EXPECT_THAT(folder.read("out/above.svg"), AllOf(HasSubstr("1 disagreement<"), HasSubstr("class=\"shown\"")));
}

/// What only POV-Ray can render is compared by its images alone.
TEST(LookImages, ASceneThatOnlyPovrayKnowsIsJudgedByWhatIsSeen) {
  const testing_support::TemporaryFolder folder;
  const auto seen = look_at(with(kMap, "x_m: 1.80, y_m: 0.25", "x_m: 1.72, y_m: 0.25"), folder, "118.0",
                            with(kScene, "background", "fog { distance 100000 color rgb 0.7 } background"));
  ASSERT_TRUE(seen) << seen.error().message;
  ASSERT_THAT(kinds(*seen), ElementsAre(Disagreement::kSighting)) << lines_of(*seen);
  EXPECT_THAT(seen->findings[0].text, HasSubstr("room.map.yaml:5: landmark red is seen from the start +"));
  EXPECT_THAT(seen->notes, Contains(HasSubstr("room.pov:4: 'fog' is not supported")));
  EXPECT_FALSE(seen->has_surfaces);
  EXPECT_THAT(folder.read("out/above.svg"), HasSubstr("data:image/jpeg"));
}

TEST(LookImages, ARigThatIsNotThatOfTheImagesIsANote) {
  const testing_support::TemporaryFolder folder;
  const auto seen = look_at(kMap, folder, "113.0");
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_THAT(kinds(*seen), IsEmpty()) << lines_of(*seen);
  EXPECT_THAT(seen->notes, Contains(HasSubstr("rig.lower states")));
}

// ---- scene geometry

TEST(SceneGeometry, ACutThingIsDarkAndWhatIsBelowIsShown) {
  const sim_povray::SceneGeometry scene = Room().geometry();
  // 0.1 m a pixel; the height cuts walls and landmarks.
  const Image image = scene.overhead({-2.3, 2.3, -1.8, 1.8, 0.5, 46});
  ASSERT_EQ(image.width_px, 46);
  ASSERT_EQ(image.height_px, 36);
  const auto green_at = [&](double x_m, double y_m) {
    return int(image.bytes[3 * std::size_t(int((1.8 - y_m) * 10) * 46 + int((x_m + 2.3) * 10)) + 1]);
  };
  EXPECT_LT(green_at(1.8, 0.25), 60) << "a landmark that is cut";
  EXPECT_LT(green_at(0.05, 1.78), 140) << "half of this pixel is wall";
  EXPECT_GT(green_at(0.5, 0.5), 100) << "the floor";
  EXPECT_NE(green_at(1.0, -0.5), green_at(0.5, 0.5)) << "the crate, below the cut";
}

}  // namespace
}  // namespace twocone::look
