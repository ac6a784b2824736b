// SPDX-License-Identifier: Apache-2.0
#include "apps/config/robot_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

TEST(RobotFile, HoldsEveryFieldOfTheFile) {
  const std::filesystem::path file = data("good_robot.yaml");
  Robot wanted;
  wanted.file = file;
  wanted.name = "nina";
  wanted.map = file.parent_path() / "rooms/cellar.map.yaml";
  wanted.start = Pose2{.x_m = 0.31, .y_m = -0.42, .heading_rad = 0.53};
  wanted.latency_frames = 3;
  wanted.body_radius_m = 0.17;
  wanted.drive = {.driver = "sim_povray",
                  .wheel_separation_m = 0.29,
                  .wheel_radius_m = 0.043,
                  .max_speed_mps = 0.37,
                  .command_timeout_s = 0.41};
  const sim_povray::CameraEffects common = {.gain = 0.9,
                                            .full_well_electrons = 9000,
                                            .read_noise_electrons = 11,
                                            .vignetting = 0.3,
                                            .defocus_px = 0.8,
                                            .exposure_time_s = 0.012,
                                            .readout_s = 0.021,
                                            .shutter_samples = 6,
                                            .distortion = {-0.11, 0.02, 0.001, -0.002},
                                            .distortion_focal_px = 512.5,
                                            .drop_probability = 0.01,
                                            .late_probability = 0.02};
  wanted.lower = {.driver = "sim_povray", .settings = {641, 479, 12.5}, .antialias = 2};
  wanted.upper = {.driver = "sim_povray", .settings = {322, 243, 12.5}, .antialias = 1};
  wanted.others = {{"aft_2", {.driver = "sim_povray", .settings = {80, 60, 12.5}, .antialias = 1}}};
  wanted.lower.effects = wanted.upper.effects = wanted.others[0].part.effects = common;
  wanted.upper.effects.gain = 1.3;
  wanted.upper.effects.defocus_px = 0;
  wanted.others[0].part.effects.distortion.clear();
  wanted.rig = {.lower = {.apex_rad = 1.5708,
                          .mirror_radius_m = 0.061,
                          .lens_to_tip_m = 0.118,
                          .centre_px = {318.25, 241.5},
                          .rim_radius_px = 233.75,
                          .azimuth_rad = 0.021,
                          .mirrored = false},
                .upper = {.apex_rad = 1.61,
                          .mirror_radius_m = 0.057,
                          .lens_to_tip_m = 0.118,
                          .centre_px = {160.5, 120.75},
                          .rim_radius_px = 117.5,
                          .azimuth_rad = -0.034,
                          .mirrored = true,
                          .tilt_rad = {0.011, -0.007}},
                .mirror_separation_m = 0.307,
                .lens_height_m = 0.23};
  wanted.effects = {
      .slip = 0.013, .encoder_counts_per_turn = 1200, .motor_lag_s = 0.07, .mass_kg = 4.2, .body_friction = 0.25};
  wanted.waypoints = {{0.5, 0.25}, {-0.75, 1.25}};
  wanted.max_skew_s = 0.011;

  const Robot robot = read_robot(file);
  EXPECT_EQ(robot.file, wanted.file);
  EXPECT_EQ(robot.name, wanted.name);
  EXPECT_EQ(robot.map, wanted.map);
  EXPECT_EQ(robot.start, wanted.start);
  EXPECT_EQ(robot.latency_frames, wanted.latency_frames);
  EXPECT_EQ(robot.body_radius_m, wanted.body_radius_m);
  EXPECT_EQ(robot.drive, wanted.drive);
  EXPECT_EQ(robot.lower, wanted.lower);
  EXPECT_EQ(robot.upper, wanted.upper);
  EXPECT_EQ(robot.others, wanted.others);
  EXPECT_EQ(robot.rig, wanted.rig);
  EXPECT_EQ(robot.effects, wanted.effects);
  EXPECT_EQ(robot.waypoints, wanted.waypoints);
  EXPECT_EQ(robot.max_skew_s, wanted.max_skew_s);
  EXPECT_EQ(robot, wanted) << "a field that this test does not check";
}

TEST(RobotFile, DefaultsAreTheDocumentedOnes) {
  std::string text = good_robot_text();
  for (const char* line : {
           "start: {x_m: 0.31, y_m: -0.42, heading_rad: 0.53}\n",
           "latency_frames: 3\n",
           "  command_timeout_s: 0.41\n",
           ", antialias: 2",
           "    mirrored: true\n",
           ", effects: {gain: 1.3, defocus_px: 0}",
           ", effects: {distortion: []}",
       }) {
    text = with(text, line, "");
  }
  text = text.substr(0, text.find("\neffects:") + 1);
  const Robot robot = parsed_robot(text);
  EXPECT_TRUE(robot.attach.empty());
  EXPECT_EQ(robot.upper.effects, sim_povray::CameraEffects{});
  EXPECT_EQ(robot.start, std::nullopt);
  EXPECT_EQ(robot.latency_frames, 4);
  EXPECT_EQ(robot.drive.command_timeout_s, 0.5);
  EXPECT_EQ(robot.lower.antialias, 1);
  EXPECT_FALSE(robot.rig.upper.mirrored);
  EXPECT_EQ(robot.effects, Effects{});
  EXPECT_DOUBLE_EQ(robot.max_skew_s, 0.048) << "0.6 of 1 / 12.5 Hz";
  EXPECT_TRUE(robot.waypoints.empty());
}

TEST(RobotFile, AStampMayBeLateInOneCameraOrInAll) {
  const Robot one = parsed_robot(with(good_robot_text(), "gain: 1.3", "stamp_late_s: 0.008"));
  EXPECT_EQ(one.lower.effects.stamp_late_s, 0);
  EXPECT_EQ(one.upper.effects.stamp_late_s, 0.008);
  const Robot all = parsed_robot(with(good_robot_text(), "late_probability: 0.02", "stamp_late_s: 0.5"));
  EXPECT_EQ(all.lower.effects.stamp_late_s, 0.5);
  EXPECT_EQ(all.upper.effects.stamp_late_s, 0.5);
}

TEST(RobotFile, TheTrueWheelsMayDiffer) {
  const Robot robot = parsed_robot(
      with(good_robot_text(), "  motor_lag_s: 0.07\n", "  wheel_separation_m: 0.2871\n  wheel_radius_m: 0.04343\n"));
  EXPECT_EQ(robot.effects.wheel_separation_m, 0.2871);
  EXPECT_EQ(robot.effects.wheel_radius_m, 0.04343);
  EXPECT_EQ(robot.drive.wheel_separation_m, 0.29);
  EXPECT_EQ(robot.drive.wheel_radius_m, 0.043);
}

TEST(RobotFile, EveryMirrorKeyMayBeCommonOrOnItsOwn) {
  const std::string all_common = R"(
  mirror: {type: cone, apex_rad: 1.5708}
  mirror_radius_m: 0.061
  lens_to_tip_m: 0.118
  mirror_separation_m: 0.307
  lens_height_m: 0.23
  centre_px: [318.25, 241.5]
  rim_radius_px: 233.75
  azimuth_rad: 0.021
  mirrored: true
)";
  const std::string own = R"(
    mirror: {type: cone, apex_rad: 1.5708}
    mirror_radius_m: 0.061
    lens_to_tip_m: 0.118
    centre_px: [318.25, 241.5]
    rim_radius_px: 233.75
    azimuth_rad: 0.021
    mirrored: true
)";
  const std::string text = good_robot_text();
  const std::size_t begin = text.find("rig:");
  const std::string before = text.substr(0, begin);
  const std::string after = text.substr(text.find("\neffects:") + 1);
  const Robot from_common = parsed_robot(before + "rig:" + all_common + after);
  const Robot from_own = parsed_robot(
      before + "rig:\n  mirror_separation_m: 0.307\n  lens_height_m: 0.23\n  lower:" + own + "  upper:" + own + after);
  EXPECT_EQ(from_common.rig, from_own.rig);
  EXPECT_EQ(from_common.rig.lower, from_common.rig.upper);
  EXPECT_EQ(from_common.rig.lower.rim_radius_px, 233.75);
  EXPECT_TRUE(from_common.rig.lower.mirrored);
}

TEST(RobotFile, NamesWhatAMirrorLacks) {
  // The key is missing in both mirrors; in one; and one mirror has no section, but its own size in the other.
  EXPECT_EQ(message_of([] { parsed_robot(with(good_robot_text(), "  lens_to_tip_m: 0.118\n", "")); }),
            "robot.yaml:17: rig.lens_to_tip_m is missing: distance d from the lens to the mirror's tip, here for both "
            "mirrors or in lower and in upper, metres");
  EXPECT_EQ(message_of([] { parsed_robot(with(good_robot_text(), "  mirror_radius_m: 0.061\n", "")); }),
            "robot.yaml:22: rig.lower.mirror_radius_m is missing: radius R of the mirror's rim, metres");
  const std::string no_lower =
      with(good_robot_text(),
           "  lower:\n    centre_px: [318.25, 241.5]\n    rim_radius_px: 233.75\n    azimuth_rad: 0.021\n", "");
  EXPECT_EQ(message_of([&] { parsed_robot(with(no_lower, "  mirror_radius_m: 0.061\n", "")); }),
            "robot.yaml:17: rig.lower is missing: the lower mirror, with its mirror_radius_m");
}

// Catches a number that is made up for one which the images must show.
TEST(RobotFile, MayLeaveToTheImagesWhatTheyShow) {
  const Robot whole = parsed_robot(good_robot_text());
  EXPECT_TRUE(whole.rig.missing.empty());
  const Robot no_lower = parsed_robot(
      with(good_robot_text(),
           "  lower:\n    centre_px: [318.25, 241.5]\n    rim_radius_px: 233.75\n    azimuth_rad: 0.021\n", ""));
  EXPECT_EQ(no_lower.rig.missing,
            (std::vector<std::string>{"lower.centre_px", "lower.rim_radius_px", "lower.azimuth_rad"}));
  // The middle of the image, and a radius that a mirror in it may have: the start of a search.
  EXPECT_EQ(no_lower.rig.lower.centre_px,
            (std::array{(no_lower.lower.settings.width_px - 1) / 2.0, (no_lower.lower.settings.height_px - 1) / 2.0}));
  EXPECT_GT(no_lower.rig.lower.rim_radius_px, 0);
  EXPECT_EQ(no_lower.rig.upper, whole.rig.upper);
  const Robot no_azimuth = parsed_robot(with(good_robot_text(), "    azimuth_rad: 0.021\n", ""));
  EXPECT_EQ(no_azimuth.rig.missing, std::vector<std::string>{"lower.azimuth_rad"});
}

TEST(RobotFile, ReportsAllErrorsAtOnceByLine) {
  std::string text = good_robot_text();
  text = with(text, "name: nina", "nam: nina");
  text = with(text, "wheel_radius_m: 0.043", "wheel_radius_m: -0.05");
  text = with(text, "  max_speed_mps: 0.37\n", "");
  text = with(text, "height_px: 479, rate_hz: 12.5", "height_px: 479.5, rate_hz: fast");
  text = with(text, "    rim_radius_px: 117.5", "    rim_radius_px: .nan");
  text = with(text, "[-0.75, 1.25]]", "[-0.75, 1.25, 7]]");
  EXPECT_EQ(
      message_of([&] { parsed_robot(text); }),
      "robot.yaml:2: name is missing: the robot's name\n"
      "robot.yaml:2: nam is unknown, did you mean name? (known here: name, map, attach, start, latency_frames, body, "
      "drive, cameras, max_skew_s, rig, estimator, effects, waypoints_m)\n"
      "robot.yaml:7: drive.max_speed_mps is missing: greatest speed of a wheel over the floor, metres a second\n"
      "robot.yaml:10: drive.wheel_radius_m is -0.05 m, must be > 0 and < 1\n"
      "robot.yaml:13: cameras.lower.height_px is 479.5 px, must be a whole number\n"
      "robot.yaml:13: cameras.lower.rate_hz is 'fast', must be a number (hertz)\n"
      "robot.yaml:28: rig.upper.rim_radius_px is .nan px, must be a finite number (pixels)\n"
      "robot.yaml:54: waypoints_m[1] is [-0.75, 1.25, 7] m, must be [x, y] (metres)");
}

TEST(RobotFile, ThroughANodeOfAnotherFileItIsTheSameRobot) {
  // run.yaml works like this: the node is written below a key of another file, in another folder, and read again.
  const Robot direct = read_robot(data("good_robot.yaml"));
  YAML::Node run;
  run["robot"] = load_robot_node(direct);
  Robot again = parse_robot(YAML::Load(YAML::Dump(run))["robot"], "/elsewhere/run.yaml");
  EXPECT_EQ(again.file, "/elsewhere/run.yaml");
  again.file = direct.file;
  EXPECT_EQ(again, direct);
}

TEST(RobotFile, AwkwardNamesComeThroughANodeUnchanged) {
  const std::pair<const char*, const char*> names[] = {{"'~'", "~"},
                                                       {"'null'", "null"},
                                                       {"'12'", "12"},
                                                       {"'true'", "true"},
                                                       {"'a: b # c'", "a: b # c"},
                                                       {"' lead'", " lead"},
                                                       {"\"two\\nlines\\t\\x07\"", "two\nlines\t\a"},
                                                       {"K\u00f6nig", "K\u00f6nig"},
                                                       {"'- x'", "- x"}};
  for (const auto& [written, name] : names) {
    YAML::Node run;
    run["robot"] = parse_yaml(with(good_robot_text(), "name: nina", fmt::format("name: {}", written)), "robot.yaml");
    EXPECT_EQ(parse_robot(run["robot"], "run.yaml").name, name) << written;
    EXPECT_EQ(parse_robot(YAML::Load(YAML::Dump(run))["robot"], "run.yaml").name, name) << written;
  }
}

// A name that contained a path made a run outside of runs/.
TEST(RobotFile, OnDiskHasANameThatIsFitForAFolder) {
  const testing_support::TemporaryFolder folder;
  const auto read_named = [&folder](const std::string& name) {
    return read_robot(folder.write("robot.yaml", with(good_robot_text(), "name: nina", "name: " + name))).name;
  };
  for (const char* const good : {"nina", "lab 2", "K\u00f6nig", "a.b", "'- x'"})
    EXPECT_NO_THROW(read_named(good)) << good;
  for (const std::string& bad : {std::string("../../x"), std::string("/tmp/x"), std::string("a/b"), std::string(".."),
                                 std::string(".hidden"), std::string("\"a\\nb\""), std::string(201, 'a')}) {
    EXPECT_THAT(message_of([&] { read_named(bad); }), testing::HasSubstr("must be fit for a folder's name")) << bad;
  }
}

TEST(RobotFile, ANodeOfARelativeFileHasAnAbsoluteMap) {
  const std::filesystem::path file = std::filesystem::relative(data("good_robot.yaml"));
  ASSERT_TRUE(file.is_relative());
  const Robot robot = parse_robot(load_robot_node(read_robot(file)), "/elsewhere/run.yaml");
  EXPECT_TRUE(robot.map.is_absolute()) << robot.map;
  EXPECT_EQ(robot.map.lexically_normal(), data("rooms/cellar.map.yaml").lexically_normal());
}

class BadRobotFile : public testing::TestWithParam<BadCase> {};

TEST_P(BadRobotFile, IsRefusedInTheseWords) {
  const std::string text = with(good_robot_text(), GetParam().find, GetParam().replace);
  EXPECT_EQ(message_of([&] { parsed_robot(text); }), GetParam().message);
}

const BadCase kBadRobotValues[] = {
    {"NegativeLength", "separation_m: 0.29", "separation_m: -0.29",
     "robot.yaml:9: drive.wheel_separation_m is -0.29 m, must be > 0 and < 5"},
    {"ZeroLength", "wheel_radius_m: 0.043", "wheel_radius_m: 0",
     "robot.yaml:10: drive.wheel_radius_m is 0 m, must be > 0 and < 1"},
    {"NegativeZero", "wheel_radius_m: 0.043", "wheel_radius_m: -0.0",
     "robot.yaml:10: drive.wheel_radius_m is -0.0 m, must be > 0 and < 1"},
    {"Infinite", "max_speed_mps: 0.37", "max_speed_mps: .inf",
     "robot.yaml:11: drive.max_speed_mps is .inf m/s, must be a finite number (metres a second)"},
    {"MinusInfinite", "x_m: 0.31", "x_m: -.INF",
     "robot.yaml:4: start.x_m is -.INF m, must be a finite number (metres)"},
    {"InfiniteAsCWritesIt", "x_m: 0.31", "x_m: inf",
     "robot.yaml:4: start.x_m is inf m, must be a finite number (metres)"},
    {"BeyondADouble", "x_m: 0.31", "x_m: 1e999",
     "robot.yaml:4: start.x_m is 1e999 m, must be a finite number (metres)"},
    {"Degrees", "heading_rad: 0.53", "heading_rad: 90",
     "robot.yaml:4: start.heading_rad is 90 rad, must be -2 pi to 2 pi"},
    {"WordForANumber", "radius_m: 0.17", "radius_m: abc",
     "robot.yaml:6: body.radius_m is 'abc', must be a number (metres)"},
    {"NumberInQuotes", "radius_m: 0.17", "radius_m: '0.17'",
     "robot.yaml:6: body.radius_m is '0.17', must be a number (metres)"},
    {"NumberWithUnit", "radius_m: 0.17", "radius_m: 0.17 m",
     "robot.yaml:6: body.radius_m is '0.17 m', must be a number (metres)"},
    {"DecimalComma", "  wheel_radius_m: 0.043", "  wheel_radius_m: 0,043",
     "robot.yaml:10: drive.wheel_radius_m is '0,043', must be a number (metres)"},
    {"NothingForANumber", "  wheel_radius_m: 0.043",
     "  wheel_radius_m:", "robot.yaml:10: drive.wheel_radius_m is empty, must be a number (metres)"},
    {"ListForANumber", "radius_m: 0.17", "radius_m: [1, 2]",
     "robot.yaml:6: body.radius_m is [1, 2] m, must be a number (metres)"},
    {"MappingForANumber", "latency_frames: 3", "latency_frames: {a: 1}",
     "robot.yaml:5: latency_frames is a mapping, must be a number"},
    {"Fraction", "latency_frames: 3", "latency_frames: 3.5",
     "robot.yaml:5: latency_frames is 3.5, must be a whole number"},
    {"NegativeCount", "latency_frames: 3", "latency_frames: -1", "robot.yaml:5: latency_frames is -1, must be >= 0"},
    {"BeyondAnInt", "latency_frames: 3", "latency_frames: 3e9",
     "robot.yaml:5: latency_frames is 3e9, must be at most 2147483647"},
    {"ImageWithoutWidth", "width_px: 641", "width_px: 0",
     "robot.yaml:14: cameras.lower.width_px is 0 px, must be 1 to 16384"},
    {"NoRate", "height_px: 243, rate_hz: 12.5", "height_px: 243, rate_hz: 0",
     "robot.yaml:15: cameras.upper.rate_hz is 0 Hz, must be 0.01 to 1000"},
    {"TwoRates", "height_px: 243, rate_hz: 12.5", "height_px: 243, rate_hz: 15",
     "robot.yaml:15: cameras.upper.rate_hz is 15 Hz, must be that of cameras.lower, 12.5"},
    {"AntialiasBeyondPovRays", "antialias: 2", "antialias: 10",
     "robot.yaml:14: cameras.lower.antialias is 10, must be 1 to 9"},
    {"AntialiasOfARealCamera", "driver: sim_povray, width_px: 641",
     "driver: v4l2_camera, device: /dev/video0, width_px: 641",
     "robot.yaml:14: cameras.lower.antialias is 2, must be absent: driver v4l2_camera has no such setting"},
    {"TimeoutTooShort", "command_timeout_s: 0.41", "command_timeout_s: 1e-9",
     "robot.yaml:12: drive.command_timeout_s is 1e-9 s, must be 0.001 to 60"},
    {"NegativeSkew", "max_skew_s: 0.011", "max_skew_s: -0.011",
     "robot.yaml:54: max_skew_s is -0.011 s, must be 0 to 60"},
    {"NegativeSlip", "slip: 0.013", "slip: -0.013", "robot.yaml:36: effects.slip is -0.013, must be >= 0"},
    {"FlatCone", "apex_rad: 1.61", "apex_rad: 3.2",
     "robot.yaml:33: rig.upper.mirror.apex_rad is 3.2 rad, must be > 0 and < pi"},
    {"OtherMirror", "mirror: {type: cone, apex_rad: 1.5708}", "mirror: {type: hyperbola, apex_rad: 1.5708}",
     "robot.yaml:18: rig.mirror.type is 'hyperbola', must be cone"},
    {"MirrorInMillimetres", "  mirror_radius_m: 0.061", "  mirror_radius_m: 61",
     "robot.yaml:19: rig.mirror_radius_m is 61 m, must be > 0 and < 1"},
    {"OverriddenCommonKeyIsCheckedToo", "  mirror_radius_m: 0.061", "  mirror_radius_m: 0",
     "robot.yaml:19: rig.mirror_radius_m is 0 m, must be > 0 and < 1"},
    {"LensUnderTheFloor", "lens_height_m: 0.23", "lens_height_m: -0.23",
     "robot.yaml:22: rig.lens_height_m is -0.23 m, must be >= 0"},
    {"YesForTrue", "mirrored: true", "mirrored: yes",
     "robot.yaml:31: rig.upper.mirrored is 'yes', must be true or false"},
    {"CentreOfThree", "[318.25, 241.5]", "[318.25, 241.5, 1]",
     "robot.yaml:24: rig.lower.centre_px is [318.25, 241.5, 1] px, must be a list of 2 numbers (pixels)"},
    {"CentreWithAWord", "[318.25, 241.5]", "[318.25, middle]",
     "robot.yaml:24: rig.lower.centre_px[1] is 'middle', must be a number (pixels)"},
    {"NoName", "name: nina", "name: ''", "robot.yaml:2: name is '', must be text that is not empty"},
    {"NameWithoutValue", "name: nina", "name:", "robot.yaml:2: name is empty, must be text that is not empty"},
    {"WaypointsAsOneList", "[[0.5, 0.25], [-0.75, 1.25]]", "[0.5, 0.25]",
     "robot.yaml:55: waypoints_m[0] is 0.5 m, must be [x, y] (metres)\n"
     "robot.yaml:55: waypoints_m[1] is 0.25 m, must be [x, y] (metres)"},
    {"WaypointsOnLinesOfTheirOwn", "waypoints_m: [[0.5, 0.25], [-0.75, 1.25]]",
     "waypoints_m:\n  - [0.5, 0.25]\n  - [-0.75, north]",
     "robot.yaml:57: waypoints_m[1][1] is 'north', must be a number (metres)"}};

INSTANTIATE_TEST_SUITE_P(Values, BadRobotFile, testing::ValuesIn(kBadRobotValues), name_of<BadCase>);

const BadCase kBadRobotKeys[] = {
    {"Misspelt", "  max_speed_mps: 0.37", "  max_sped_mps: 0.37",
     "robot.yaml:7: drive.max_speed_mps is missing: greatest speed of a wheel over the floor, metres a second\n"
     "robot.yaml:11: drive.max_sped_mps is unknown, did you mean max_speed_mps? (known here: driver, "
     "wheel_separation_m, wheel_radius_m, max_speed_mps, command_timeout_s, sigma)"},
    {"WithoutItsUnit", "body: {radius_m: 0.17}", "body: {radius: 0.17}",
     "robot.yaml:6: body.radius_m is missing: radius of the body, seen from above, metres\n"
     "robot.yaml:6: body.radius is unknown, did you mean radius_m? (known here: radius_m)"},
    {"LikeNoOther", "  slip: 0.013", "  earthquakes: 1",
     "robot.yaml:36: effects.earthquakes is unknown (known here: slip, encoder_counts_per_turn, motor_lag_s, "
     "wheel_separation_m, wheel_radius_m, mass_kg, wheel_friction, body_friction, camera)"},
    {"Twice", "  max_speed_mps: 0.37", "  max_speed_mps: 0.37\n  max_speed_mps: 0.5",
     "robot.yaml:12: drive.max_speed_mps is given twice, the first time in line 11"},
    {"TwiceInOneLine", "{radius_m: 0.17}", "{radius_m: 0.17, radius_m: 0.17}",
     "robot.yaml:6: body.radius_m is given twice, the first time in line 6"},
    {"NotAWord", "{radius_m: 0.17}", "{radius_m: 0.17, [1, 2]: 3}",
     "robot.yaml:6: body has a list of 2 as a key, must be a word"},
    {"MergeKeyIsNoKey", "body: {radius_m: 0.17}", "body: {<<: {radius_m: 0.17}}",
     "robot.yaml:6: body.radius_m is missing: radius of the body, seen from above, metres\n"
     "robot.yaml:6: body.<< is unknown (known here: radius_m)"},
    {"NoDrive",
     "drive:\n  driver: sim_povray\n  wheel_separation_m: 0.29\n  wheel_radius_m: 0.043\n"
     "  max_speed_mps: 0.37\n  command_timeout_s: 0.41\n",
     "", "robot.yaml:2: drive is missing: the two wheels: driver, sizes, limits"},
    {"WordForAMapping", "body: {radius_m: 0.17}", "body: round", "robot.yaml:6: body is 'round', must be a mapping"},
    {"StartInPart", "start: {x_m: 0.31, y_m: -0.42, heading_rad: 0.53}", "start: {x_m: 0.31}",
     "robot.yaml:4: start.y_m is missing: y at t = 0, metres\n"
     "robot.yaml:4: start.heading_rad is missing: heading at t = 0, counter-clockwise from x, radians"},
    {"ControlCharactersStayInLine", "name: nina", "name: nina\n\"bell\\a\\nline\": 1",
     "robot.yaml:3: bell\\x07\\x0aline is unknown (known here: name, map, attach, start, latency_frames, "
     "body, drive, "
     "cameras, max_skew_s, rig, estimator, effects, waypoints_m)"}};

INSTANTIATE_TEST_SUITE_P(Keys, BadRobotFile, testing::ValuesIn(kBadRobotKeys), name_of<BadCase>);

const BadCase kSimulationCases[] = {
    {"AttachToAPath", "latency_frames: 3", "attach: ../hall",
     "robot.yaml:5: attach is '../hall', must be letters, digits, - and _"},
    {"LagBeyondReason", "motor_lag_s: 0.07", "motor_lag_s: -0.07",
     "robot.yaml:38: effects.motor_lag_s is -0.07 s, must be 0 to 60"},
    {"WheelsOnTopOfEachOther", "  motor_lag_s: 0.07", "  wheel_separation_m: 0",
     "robot.yaml:38: effects.wheel_separation_m is 0 m, must be > 0 and < 5"},
    {"WheelsInsideOut", "  motor_lag_s: 0.07", "  wheel_radius_m: -0.05",
     "robot.yaml:38: effects.wheel_radius_m is -0.05 m, must be > 0 and < 1"},
    {"Weightless", "mass_kg: 4.2", "mass_kg: 0", "robot.yaml:39: effects.mass_kg is 0 kg, must be > 0"},
    {"WheelsOnIce", "  mass_kg: 4.2", "  wheel_friction: 0", "robot.yaml:39: effects.wheel_friction is 0, must be > 0"},
    {"NegativeFriction", "body_friction: 0.25", "body_friction: -0.25",
     "robot.yaml:40: effects.body_friction is -0.25, must be >= 0"},
    {"FurtherCameraOfAnotherRate", "height_px: 60, rate_hz: 12.5", "height_px: 60, rate_hz: 25",
     "robot.yaml:16: cameras.aft_2.rate_hz is 25 Hz, must be that of cameras.lower, 12.5"},
    {"FurtherCameraThatNoSceneCanHave",
     "  aft_2:", "  aft-2:", "robot.yaml:16: cameras.aft-2 is a mapping, must be named with letters, digits and _"},
    {"FurtherCameraIsAWord",
     "{driver: sim_povray, width_px: 80, height_px: 60, rate_hz: 12.5, effects: {distortion: []}}", "none",
     "robot.yaml:16: cameras.aft_2 is 'none', must be a mapping"},
    {"FurtherCameraInPart", "width_px: 80, height_px: 60, ", "width_px: 80, ",
     "robot.yaml:16: cameras.aft_2.height_px is missing: height of the image, pixels"},
    {"EffectsOfARealCamera", "aft_2: {driver: sim_povray", "aft_2: {driver: v4l2_camera, device: /dev/video0",
     "robot.yaml:16: cameras.aft_2.effects is a mapping, must be absent: driver v4l2_camera has no such "
     "setting"}};

INSTANTIATE_TEST_SUITE_P(Simulation, BadRobotFile, testing::ValuesIn(kSimulationCases), name_of<BadCase>);

const BadCase kCameraEffectsCases[] = {
    {"UnknownForAll", "    gain: 0.9", "    gian: 0.9",
     "robot.yaml:42: effects.camera.gian is unknown (known here: gain, full_well_electrons, "
     "read_noise_electrons, vignetting, defocus_px, exposure_time_s, readout_s, shutter_samples, distortion, "
     "distortion_focal_px, drop_probability, late_probability, stamp_late_s, colour_gain, flicker, jpeg_quality)"},
    {"TwoColours", "late_probability: 0.02", "colour_gain: [1.06, 1]",
     "robot.yaml:53: effects.camera.colour_gain is [1.06, 1], must be a list of 0 or 3 numbers"},
    {"NoRed", "late_probability: 0.02", "colour_gain: [0, 1, 0.93]",
     "robot.yaml:53: effects.camera.colour_gain[0] is 0, must be > 0 and < 1000000"},
    {"LampsBelowDarkness", "late_probability: 0.02", "flicker: 1.2",
     "robot.yaml:53: effects.camera.flicker is 1.2, must be 0 to 1"},
    {"QualityOfAHundredAndOne", "late_probability: 0.02", "jpeg_quality: 101",
     "robot.yaml:53: effects.camera.jpeg_quality is 101, must be 0 to 100"},
    {"NoGain", "gain: 0.9", "gain: 0", "robot.yaml:42: effects.camera.gain is 0, must be > 0 and < 1000000"},
    {"NoGainOfOne", "gain: 1.3", "gain: 0",
     "robot.yaml:15: cameras.upper.effects.gain is 0, must be > 0 and < 1000000"},
    {"NegativeWell", "full_well_electrons: 9000", "full_well_electrons: -1",
     "robot.yaml:43: effects.camera.full_well_electrons is -1 e, must be 0 to 1000000000000"},
    {"ReadNoiseOfUnknownScale", "    full_well_electrons: 9000\n", "",
     "robot.yaml:43: effects.camera.read_noise_electrons is 11 e, must be absent or 0 without "
     "full_well_electrons"},
    {"ReadNoiseOfAnEmptyWell", "gain: 1.3", "full_well_electrons: 0",
     "robot.yaml:15: cameras.upper.effects.full_well_electrons is 0 e, must be > 0 where there is "
     "read_noise_electrons"},
    {"MoreThanAllLight", "vignetting: 0.3", "vignetting: 1.1",
     "robot.yaml:45: effects.camera.vignetting is 1.1, must be 0 to 1"},
    {"DefocusInMillions", "defocus_px: 0.8", "defocus_px: 1e6",
     "robot.yaml:46: effects.camera.defocus_px is 1e6 px, must be 0 to 50"},
    {"NegativeShutter", "exposure_time_s: 0.012", "exposure_time_s: -0.012",
     "robot.yaml:47: effects.camera.exposure_time_s is -0.012 s, must be 0 to 60"},
    {"OneExposure", "shutter_samples: 6", "shutter_samples: 1",
     "robot.yaml:49: effects.camera.shutter_samples is 1, must be 2 to 64"},
    {"ExposuresOfNoTime", "    exposure_time_s: 0.012\n    readout_s: 0.021\n", "",
     "robot.yaml:47: effects.camera.shutter_samples is 6, must be absent without exposure_time_s and readout_s"},
    {"ReadoutBeyondTheFrame", "readout_s: 0.021", "readout_s: 0.07",
     "robot.yaml:48: effects.camera.readout_s is 0.07 s, must be less than a frame period, 0.08 s, together "
     "with exposure_time_s"},
    {"ExposureOfOneBeyondTheFrame", "gain: 1.3", "exposure_time_s: 0.06",
     "robot.yaml:15: cameras.upper.effects.exposure_time_s is 0.06 s, must be less than a frame period, 0.08 s, "
     "together with readout_s"},
    {"DistortionOfThree", "[-0.11, 0.02, 0.001, -0.002]", "[-0.11, 0.02, 0.001]",
     "robot.yaml:50: effects.camera.distortion is [-0.11, 0.02, 0.001], must be a list of 0 or 4 or 5 "
     "numbers"},
    {"DistortionOfAWord", "-0.002]", "small]",
     "robot.yaml:50: effects.camera.distortion[3] is 'small', must be a number"},
    {"DistortionWithoutFocalLength", "    distortion_focal_px: 512.5\n", "",
     "robot.yaml:50: effects.camera.distortion is [-0.11, 0.02, 0.001, -0.002], must be absent or empty "
     "without distortion_focal_px"},
    {"DistortionOfNoFocalLength", "distortion_focal_px: 512.5", "distortion_focal_px: 0",
     "robot.yaml:51: effects.camera.distortion_focal_px is 0 px, must be > 0 where there is a distortion"},
    {"DistortionOfTwoFocalLengths", "distortion_focal_px: 512.5", "distortion_focal_px: [512.5, 510]",
     "robot.yaml:51: effects.camera.distortion_focal_px is [512.5, 510] px, must be one number, or twice "
     "the same: a simulated lens has one"},
    {"CertainLoss", "drop_probability: 0.01", "drop_probability: 1",
     "robot.yaml:52: effects.camera.drop_probability is 1, must be 0 to below 1"},
    {"CertainDelay", "late_probability: 0.02", "late_probability: -0.02",
     "robot.yaml:53: effects.camera.late_probability is -0.02, must be 0 to below 1"},
    {"StampInMilliseconds", "late_probability: 0.02", "stamp_late_s: 8",
     "robot.yaml:53: effects.camera.stamp_late_s is 8 s, must be 0 to 0.5"},
    {"StampBeforeTheExposure", "gain: 1.3", "stamp_late_s: -0.008",
     "robot.yaml:15: cameras.upper.effects.stamp_late_s is -0.008 s, must be 0 to 0.5"}};

INSTANTIATE_TEST_SUITE_P(CameraEffects, BadRobotFile, testing::ValuesIn(kCameraEffectsCases), name_of<BadCase>);

TEST(RobotFile, TakesTheFocalLengthOfASimulatedLensAsAPairToo) {
  const std::string pair = with(good_robot_text(), "distortion_focal_px: 512.5", "distortion_focal_px: [512.5, 512.5]");
  EXPECT_EQ(parsed_robot(pair), parsed_robot(good_robot_text()));
}

TEST(RobotFile, ReportsAFocalLengthWithoutDistortion) {
  std::string text = with(good_robot_text(), "    distortion: [-0.11, 0.02, 0.001, -0.002]\n", "");
  EXPECT_EQ(message_of([&] { parsed_robot(text); }), "no error") << "one camera has `distortion: []`";
  text = with(text, ", effects: {distortion: []}", "");
  EXPECT_EQ(message_of([&] { parsed_robot(text); }),
            "robot.yaml:50: effects.camera.distortion_focal_px is 512.5 px, must be absent without distortion");
}

}  // namespace
}  // namespace twocone::config
