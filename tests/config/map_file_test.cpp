// SPDX-License-Identifier: Apache-2.0
#include "apps/config/map_file.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

std::string good_map_text() { return read_text(data("good_map.yaml")); }
Map map_of(const std::string& text) { return parse_map(parse_yaml(text, "map.yaml"), "map.yaml"); }

TEST(MapFile, HoldsEveryFieldOfTheFile) {
  const std::filesystem::path file = data("good_map.yaml");
  Map wanted;
  wanted.file = file;
  wanted.scene = file.parent_path() / "cellar.pov";
  wanted.scene_paths = {file.parent_path(), file.parent_path() / "parts", "/usr/share/doc/povray/examples"};
  wanted.unit_m = 0.04;
  wanted.bounds = {.min_x_m = -2.1, .max_x_m = 3.3, .min_y_m = -1.7, .max_y_m = 2.9};
  wanted.landmarks = {{.name = "red",
                       .colour = {0.9, 0.1, 0.05},
                       .x_m = -1.9,
                       .y_m = 0.7,
                       .radius_m = 0.08,
                       .top_m = 0.95,
                       .sigma = {.x_m = 0.004, .y_m = 0.006, .top_m = 0.002, .radius_m = 0.0005}},
                      {.name = "green",
                       .colour = {0, 1, 0},
                       .x_m = 2.3,
                       .y_m = -1.1,
                       .radius_m = 0.11,
                       .top_m = 1.05,
                       .sigma = kTapeSigma}};
  wanted.without_sigma = {"green"};
  wanted.obstacles = {Polygon{{0.1, 0.2}, {0.9, 0.3}, {0.4, 1.1}}, Disc{{1.2, -0.8}, 0.25}};
  wanted.moving = moving_in_good_map();
  wanted.effects = {.shadows = false, .photons = false, .reflection_depth = 3};

  const Map map = read_map(file);
  EXPECT_EQ(map.scene, wanted.scene);
  EXPECT_EQ(map.scene_paths, wanted.scene_paths) << "the map's own folder is always included";
  EXPECT_EQ(map.unit_m, wanted.unit_m);
  EXPECT_EQ(map.bounds, wanted.bounds);
  EXPECT_EQ(map.landmarks, wanted.landmarks);
  EXPECT_EQ(map.without_sigma, wanted.without_sigma);
  EXPECT_EQ(map.obstacles, wanted.obstacles);
  EXPECT_EQ(map.moving, wanted.moving);
  EXPECT_EQ(map.effects, wanted.effects);
  EXPECT_EQ(map, wanted) << "a field that this test does not check";
}

TEST(MapFile, BandedLandmarksAreReadAndWritten) {
  const testing_support::TemporaryFolder folder;
  const auto original = folder.write(
      "bands.map.yaml", with(good_map_text(), "colour: [0, 1, 0], x_m: 2.3, y_m: -1.1, radius_m: 0.11, top_m: 1.05",
                             "bands: 64, cell_m: 0.03, x_m: 2.3, y_m: -1.1, radius_m: 0.11, line_m: 0.9"));
  Map map = read_map(original);
  ASSERT_EQ(map.landmarks.size(), 2U);
  EXPECT_EQ(map.landmarks[1].bands, (Bands{64, 0.03}));
  EXPECT_EQ(map.landmarks[1].top_m, 0.9);
  EXPECT_FALSE(map.landmarks[0].bands);
  map.landmarks.push_back(map.landmarks[1]);
  map.landmarks.back().name = "other";
  map.landmarks.back().bands = Bands{3};
  const auto file = folder.path() / "new.map.yaml";
  const Map again = parse_map(parse_yaml(map_text(original, file, map, {}), file), file);
  EXPECT_EQ(again.landmarks[1].bands, map.landmarks[1].bands);
  EXPECT_EQ(again.landmarks[2].bands, (Bands{3}));
  EXPECT_EQ(again.landmarks[2].top_m, 0.9);
  map.landmarks.back().bands = Bands{64};
  EXPECT_THROW(static_cast<void>(map_text(original, file, map, {})), FileError) << "two of one number";
}

TEST(MapFile, ARealRoomHasNeitherSceneNorUnit) {
  std::string text = with(good_map_text(), "scene: cellar.pov\nunit_m: 0.04\n", "");
  text = text.substr(0, text.find("moving:"));
  const Map map = map_of(text);
  EXPECT_EQ(map.scene, std::nullopt);
  EXPECT_TRUE(map.moving.empty());
  EXPECT_EQ(map.effects, SceneEffects{}) << "all effects that the scene uses";
  EXPECT_EQ(map.landmarks.size(), 2u);
}

TEST(MapFile, ThroughANodeOfAnotherFileItIsTheSameMap) {
  const Map direct = read_map(data("good_map.yaml"));
  YAML::Node run;
  run["map"] = load_map_node(data("good_map.yaml"));
  Map again = parse_map(YAML::Load(YAML::Dump(run))["map"], "/elsewhere/run.yaml");
  again.file = direct.file;
  EXPECT_EQ(again, direct);
}

TEST(MapFile, ANodeOfARelativeFileHasAnAbsoluteScene) {
  const std::filesystem::path file = std::filesystem::relative(data("good_map.yaml"));
  ASSERT_TRUE(file.is_relative());
  const Map map = parse_map(load_map_node(file), "/elsewhere/run.yaml");
  ASSERT_TRUE(map.scene.has_value());
  EXPECT_TRUE(map.scene->is_absolute()) << *map.scene;
  EXPECT_EQ(map.scene->lexically_normal(), data("cellar.pov").lexically_normal());
}

TEST(MapFile, ANodeOfARealRoomGetsNoScene) {
  const testing_support::TemporaryFolder folder;
  const auto file = folder.write("room.map.yaml", "bounds_m: {x: [0, 1], y: [0, 1]}\nlandmarks: []\n");
  EXPECT_EQ(parse_map(load_map_node(file), file).scene, std::nullopt);
}

// Catches a common sigma that stays and hides that of a landmark, and a part of the map that gets lost.
TEST(MapFile, WithOtherLandmarksAndAnotherSceneItIsTheSameMapElsewhere) {
  const testing_support::TemporaryFolder folder;
  const auto original = folder.write("theirs.map.yaml", "landmark_sigma_m: 0.009\n" + good_map_text());
  Map changed = read_map(original);
  changed.scene = "other.pov";
  changed.landmarks.pop_back();
  changed.landmarks[0].x_m = -1.0 / 3;
  changed.landmarks[0].sigma = {.x_m = 0.1 / 3, .y_m = 0, .top_m = 0.002, .radius_m = 1e-5};
  changed.landmarks.push_back(
      {.name = "exact", .colour = {0, 0.2, 1}, .x_m = 1, .y_m = 2, .radius_m = 0.1, .top_m = 1});
  const auto file = folder.path() / "deeper" / "new.map.yaml";
  const std::string text = map_text(original, file, changed, {"Two\nlines."});
  EXPECT_NE(text.find("# Two\n# lines.\n"), std::string::npos) << text;
  const Map map = parse_map(parse_yaml(text, file), file);
  EXPECT_EQ(map.scene, folder.path() / "deeper" / "other.pov");
  EXPECT_EQ(map.landmarks, changed.landmarks);
  EXPECT_TRUE(map.without_sigma.empty());
  EXPECT_EQ(map.scene_paths, changed.scene_paths);
  EXPECT_EQ(map.obstacles, changed.obstacles);
  EXPECT_EQ(map.moving, changed.moving);
  EXPECT_EQ(map.effects, changed.effects);
  EXPECT_EQ(map.bounds, changed.bounds);
  changed.landmarks[0].radius_m = -1;
  EXPECT_THROW(static_cast<void>(map_text(original, file, changed, {})), FileError);
}

TEST(MapFile, ASceneInPlaceOfAMapIsRejected) {
  EXPECT_EQ(message_of([] { (void)read_map("rooms/x.pov"); }),
            "rooms/x.pov: is a POV-Ray scene; a map is wanted, a YAML file that names the scene: `scene: x.pov`");
}

class BadMapFile : public testing::TestWithParam<BadCase> {};

TEST_P(BadMapFile, IsRefusedInTheseWords) {
  const std::string text = with(good_map_text(), GetParam().find, GetParam().replace);
  EXPECT_EQ(message_of([&] { map_of(text); }), GetParam().message);
}

const BadCase kBadMapKeys[] = {
    {"SceneWithoutUnit", "unit_m: 0.04\n", "",
     "map.yaml:2: unit_m is missing: length of one POV-Ray unit of the scene, metres"},
    {"ZeroUnit", "unit_m: 0.04", "unit_m: 0", "map.yaml:3: unit_m is 0 m, must be > 0"},
    {"BoundsTurnedRound", "x: [-2.1, 3.3]", "x: [3.3, -2.1]",
     "map.yaml:4: bounds_m.x is [3.3, -2.1] m, must be [least, greatest], least < greatest"},
    {"BoundsOfNoWidth", "y: [-1.7, 2.9]", "y: [2.9, 2.9]",
     "map.yaml:4: bounds_m.y is [2.9, 2.9] m, must be [least, greatest], least < greatest"},
    {"BoundsAreANumber", "{x: [-2.1, 3.3], y: [-1.7, 2.9]}", "5", "map.yaml:4: bounds_m is 5, must be a mapping"},
    {"NamesakeLandmarks", "name: green", "name: red",
     "map.yaml:7: landmarks[1].name is 'red', must be unlike every other landmark's"},
    {"LandmarkWithoutName", "name: green", "name: ''",
     "map.yaml:7: landmarks[1].name is '', must be text that is not empty"},
    {"GreyLandmark", "colour: [0, 1, 0]", "colour: [0.5, 0.5, 0.5]",
     "map.yaml:7: landmarks[1].colour is [0.5, 0.5, 0.5], must be a colour with a hue, not grey: the hue "
     "identifies it, or bands: NUMBER"},
    {"BandsAndColour", "colour: [0, 1, 0]", "colour: [0, 1, 0], bands: 5, line_m: 0.9",
     "map.yaml:7: landmarks[1].colour is [0, 1, 0], must be absent: its bands identify it\n"
     "map.yaml:7: landmarks[1].top_m is 1.05 m, must be absent: line_m is the height that is measured"},
    {"NoSuchBands", "colour: [0, 1, 0], x_m: 2.3, y_m: -1.1, radius_m: 0.11, top_m: 1.05",
     "bands: 65, x_m: 2.3, y_m: -1.1, radius_m: 0.11, line_m: 0.9",
     "map.yaml:7: landmarks[1].bands is 65, must be 1 to 64"},
    {"BandsWithoutLine", "colour: [0, 1, 0], x_m: 2.3, y_m: -1.1, radius_m: 0.11, top_m: 1.05",
     "bands: 6, x_m: 2.3, y_m: -1.1, radius_m: 0.11",
     "map.yaml:7: landmarks[1].line_m is missing: height above the floor of the line that the print marks, metres"},
    {"ColourOf255", "colour: [0, 1, 0]", "colour: [0, 255, 0]",
     "map.yaml:7: landmarks[1].colour[1] is 255, must be 0 to 1"},
    {"ColourByName", "colour: [0, 1, 0]", "colour: green",
     "map.yaml:7: landmarks[1].colour is 'green', must be a list of 3 numbers"},
    {"LandmarkBeyondXWall", "x_m: 2.3", "x_m: 3.4",
     "map.yaml:7: landmarks[1].x_m is 3.4 m, must be within bounds_m.x, -2.1 to 3.3"},
    {"LandmarkBeyondYWall", "y_m: -1.1", "y_m: -2",
     "map.yaml:7: landmarks[1].y_m is -2 m, must be within bounds_m.y, -1.7 to 2.9"},
    {"ThinLandmark", "radius_m: 0.11, top_m", "radius_m: 0, top_m",
     "map.yaml:7: landmarks[1].radius_m is 0 m, must be > 0"},
    {"FlatLandmark", "top_m: 1.05", "top_m: -1.05", "map.yaml:7: landmarks[1].top_m is -1.05 m, must be > 0"},
    {"LandmarkIsAWord",
     "  - {name: red, colour: [0.9, 0.1, 0.05], x_m: -1.9, y_m: 0.7, radius_m: 0.08, top_m: 0.95, "
     "sigma_m: [0.004, 0.006, 0.002, 0.0005]}",
     "  - red", "map.yaml:6: landmarks[0] is 'red', must be a mapping"},
    {"TwoCorners", "[0.9, 0.3], [0.4, 1.1]", "[0.9, 0.3]",
     "map.yaml:9: obstacles[0].polygon_m is a list of 2, must be at least 3 corners"},
    {"BowTie", "[[0.1, 0.2], [0.9, 0.3], [0.4, 1.1]]", "[[0, 0], [1, 1], [1, 0], [0, 1.3]]",
     "map.yaml:9: obstacles[0].polygon_m is a list of 4, must be corners in turn, each once, of an outline "
     "that does not cross itself"},
    {"CircleOfNoSize", "radius: 0.25", "radius: 0", "map.yaml:10: obstacles[1].circle_m.radius is 0 m, must be > 0"},
    {"CircleOfNothing", "circle_m: {x: 1.2, y: -0.8, radius: 0.25}", "circle_m: {}",
     "map.yaml:10: obstacles[1].circle_m.x is missing: x of its centre, metres\n"
     "map.yaml:10: obstacles[1].circle_m.y is missing: y of its centre, metres\n"
     "map.yaml:10: obstacles[1].circle_m.radius is missing: its radius, metres"},
    {"ObstacleOfBothKinds", "radius: 0.25}}", "radius: 0.25}, polygon_m: [[0, 0], [1, 0], [0, 1]]}",
     "map.yaml:10: obstacles[1] has polygon_m and circle_m, must have one of them"},
    {"ObstacleOfNeitherKind", "{circle_m: {x: 1.2, y: -0.8, radius: 0.25}}", "{}",
     "map.yaml:10: obstacles[1] has neither polygon_m nor circle_m, must have one of them"},
    {"UnknownKey", "effects: {", "efects: {",
     "map.yaml:14: efects is unknown, did you mean effects? (known here: scene, scene_paths, unit_m, "
     "bounds_m, landmark_sigma_m, landmarks, "
     "survey, obstacles, moving, effects)"}};

INSTANTIATE_TEST_SUITE_P(All, BadMapFile, testing::ValuesIn(kBadMapKeys), name_of<BadCase>);

const BadCase kBadMovingKeys[] = {
    {"WithoutAnything", "{name: cat, path_m: [[-1.2, 2.1], [-0.3, 2.2]], speed_mps: 0.6, radius_m: 0.11}", "{}",
     "map.yaml:13: moving[1].name is missing: its name: the scene calls it moving.NAME\n"
     "map.yaml:13: moving[1].path_m is missing: the points that it goes to in turn, metres\n"
     "map.yaml:13: moving[1].speed_mps is missing: its speed, metres a second\n"
     "map.yaml:13: moving[1].radius_m is missing: radius of the disc that stops a robot, metres"},
    {"Namesake", "name: cat", "name: cart_2",
     "map.yaml:13: moving[1].name is 'cart_2', must be unlike every other moving thing's"},
    {"NameThatNoSceneCanHave", "name: cat", "name: my cat",
     "map.yaml:13: moving[1].name is 'my cat', must be letters, digits and _"},
    {"PathOfOnePoint", "[[-1.2, 2.1], [-0.3, 2.2]]", "[[-1.2, 2.1]]",
     "map.yaml:13: moving[1].path_m is a list of 1, must be at least 2 points"},
    {"PointTwice", "[1.7, -1.3], [1.1, 0.4]]", "[1.7, -1.3], [1.7, -1.3], [1.1, 0.4]]",
     "map.yaml:12: moving[0].path_m is a list of 4, must be a path whose neighbouring points differ"},
    {"LoopClosedTwice", "[1.1, 0.4]]", "[1.1, 0.4], [0.2, -1.1]]",
     "map.yaml:12: moving[0].path_m is a list of 4, must be a path whose last point is not its first: loop "
     "leads back"},
    {"ThroughAWall", "[-0.3, 2.2]]", "[-0.3, 3.2]]",
     "map.yaml:13: moving[1].path_m is a list of 2, must be within bounds_m"},
    {"StandsStill", "speed_mps: 0.6", "speed_mps: 0", "map.yaml:13: moving[1].speed_mps is 0 m/s, must be > 0"},
    {"OfNoSize", "radius_m: 0.19", "radius_m: 0", "map.yaml:12: moving[0].radius_m is 0 m, must be > 0"},
    {"LoopOfOne", "loop: true", "loop: 1", "map.yaml:12: moving[0].loop is 1, must be true or false"},
    {"AMapping", "  - {name: cart_2", "  cart: {name: cart_2", "map.yaml:13:3: end of map not found"}};

INSTANTIATE_TEST_SUITE_P(Moving, BadMapFile, testing::ValuesIn(kBadMovingKeys), name_of<BadCase>);

const BadCase kEffectsCases[] = {
    {"Unknown", "shadows: false", "rolling_shutter: 0.01",
     "map.yaml:14: effects.rolling_shutter is unknown (known here: shadows, area_lights, photons, "
     "radiosity, media, reflection_depth, renderer)"},
    {"OffForFalse", "shadows: false", "shadows: off", "map.yaml:14: effects.shadows is 'off', must be true or false"},
    {"NoReflection", "reflection_depth: 3", "reflection_depth: 0",
     "map.yaml:14: effects.reflection_depth is 0, must be 1 to 256"},
    {"TooManyReflections", "reflection_depth: 3", "reflection_depth: 257",
     "map.yaml:14: effects.reflection_depth is 257, must be 1 to 256"},
    {"HalfAReflection", "reflection_depth: 3", "reflection_depth: 2.5",
     "map.yaml:14: effects.reflection_depth is 2.5, must be a whole number"}};

INSTANTIATE_TEST_SUITE_P(Effects, BadMapFile, testing::ValuesIn(kEffectsCases), name_of<BadCase>);

struct Outline {
  const char* name;
  bool is_simple;
  Polygon corners;
  friend void PrintTo(const Outline& outline, std::ostream* out) { *out << outline.name; }
};

class PolygonTest : public testing::TestWithParam<Outline> {};

TEST_P(PolygonTest, IsSimpleOrNotFromAnyCornerAndEitherWayRound) {
  Polygon corners = GetParam().corners;
  for (int way = 0; way < 2; ++way) {
    for (std::size_t first = 0; first < corners.size(); ++first) {
      EXPECT_EQ(is_simple(corners), GetParam().is_simple) << "from corner " << first << ", way " << way;
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    }
    std::reverse(corners.begin(), corners.end());
  }
}

const Outline kOutlinesCases[] = {
    {"Triangle", true, {{0.3, 0.1}, {1.7, 0.4}, {0.6, 1.9}}},
    {"Rectangle", true, {{-1.01, 0.84}, {-0.39, 0.84}, {-0.39, 1.26}, {-1.01, 1.26}}},
    {"LShape", true, {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}}},
    {"CornerInMidEdge", true, {{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}}},
    {"DeepNotch", true, {{0, 0}, {4, 0}, {4, 3}, {2, 0.001}, {0, 3}}},
    {"BowTie", false, {{0, 0}, {2, 2}, {2, 0}, {0, 2.3}}},
    {"Pentagram", false, {{0, 1}, {0.59, -0.81}, {-0.95, 0.31}, {0.95, 0.31}, {-0.59, -0.81}}},
    {"InLine", false, {{0, 0}, {1, 1}, {3, 3}}},
    {"Spike", false, {{0, 0}, {2, 0}, {2, 2}, {2, 1}, {0, 1}}},
    {"FirstCornerAgainAtTheEnd", false, {{0, 0}, {2, 0}, {1, 2}, {0, 0}}},
    {"TouchesItselfInACorner", false, {{0, 0}, {4, 0}, {4, 3}, {2, 0}, {0, 3}}},
    {"RunsBackAlongAnEdge", false, {{0, 0}, {1, 0}, {1, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 0.5}, {0, 0.5}}},
    {"TwoCorners", false, {{0, 0}, {1, 1}}},
    {"OneCorner", false, {{0, 0}}}};

INSTANTIATE_TEST_SUITE_P(Outlines, PolygonTest, testing::ValuesIn(kOutlinesCases), name_of<Outline>);

TEST(PolygonTest, NoCornersAreNoOutline) { EXPECT_FALSE(is_simple({})); }

}  // namespace
}  // namespace twocone::config
