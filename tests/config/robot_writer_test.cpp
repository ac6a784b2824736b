// SPDX-License-Identifier: Apache-2.0
#include "apps/config/robot_file.h"

#include <cmath>
#include <fstream>
#include <numbers>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

namespace fs = std::filesystem;

class RobotWriterTest : public testing::Test {
 protected:
  RobotWriterTest() { fs::create_directories(folder_ / "out"); }

  /// Writes the changed robot of changed.file to out/, as after a calibration, and reads it back.
  Robot write_and_read(const Robot& changed) {
    const fs::path file = folder_ / "out" / "calibrated.yaml";
    text_ = robot_text(changed.file, file, changed, {"First line.", "Second\nline."});
    std::ofstream(file) << text_;
    return read_robot(file);
  }

  /// Returns the text of the changed robot, and expects that it reads back equal.
  static std::string text_that_reads_back(const fs::path& file, const Robot& changed) {
    std::string text = robot_text(file, file, changed, {});
    EXPECT_EQ(parse_robot(parse_yaml(text, file), file), changed) << text;
    return text;
  }

  const testing_support::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
  std::string text_;
};

/// Returns `robot` as if it came from the file of `other`.
Robot as_of(Robot robot, const Robot& other) {
  EXPECT_EQ(fs::weakly_canonical(robot.map), fs::weakly_canonical(other.map));
  robot.file = other.file;
  robot.map = other.map;
  return robot;
}

TEST_F(RobotWriterTest, WithNothingChangedItIsTheSameRobot) {
  const fs::path lab = fs::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml";
  for (const fs::path& file : {lab, data("good_robot.yaml")}) {
    const Robot robot = read_robot(file);
    EXPECT_EQ(as_of(write_and_read(robot), robot), robot) << text_;
  }
}

TEST_F(RobotWriterTest, NumbersReadBackEqual) {
  const fs::path file = data("good_robot.yaml");
  Robot wanted = read_robot(file);
  wanted.rig.mirror_separation_m = 0.1 + 0.2;
  wanted.rig.lens_height_m = 1.0 / 3;
  for (RigView* view : {&wanted.rig.lower, &wanted.rig.upper}) {
    const double sign = view == &wanted.rig.lower ? 1 : -1;
    view->apex_rad = std::numbers::pi / 2 + sign * 1e-3 / 7;
    view->mirror_radius_m = 0.06 + sign * 1e-5 / 7;
    view->lens_to_tip_m = 0.12 - sign * 1e-5 / 3;
    view->centre_px = {319.5 + sign / 3, 239.5 - sign / 7};
    view->rim_radius_px = 236 + sign * std::sqrt(2) / 9;
    view->azimuth_rad = sign * 1e-17 / 3;
    view->tilt_rad = {sign * 0.5 / 57, -sign * 1e-300};
    view->axis_offset_m = {-sign * 0.002 / 3, 5e-324};
    view->late_s = -sign * 0.02 / 3;
    view->readout_s = 0.031 / 7;
    view->distortion = {-0.1 / 3, 0.02 / 7, 0.001 / 9, -0.002 / 11};
    view->distortion_focal_px = {708.0 / 0.9, 709.0 / 1.1};
    view->distortion_principal_px = {322.0 / 1.3, 243.0 / 1.7};
  }
  wanted.drive.wheel_separation_m = 0.29 * 1.01 / 3;
  wanted.drive.wheel_radius_m = 0.043 / 1.0103;
  const Robot again = write_and_read(wanted);
  EXPECT_EQ(again.rig, wanted.rig) << text_;
  EXPECT_EQ(as_of(again, wanted), wanted) << text_;
}

TEST_F(RobotWriterTest, WhatBothMirrorsHaveStandsOnce) {
  Robot robot = read_robot(fs::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml");
  const auto count = [&](const std::string& key) {
    std::size_t found = 0;
    for (std::size_t at = text_.find(key); at != std::string::npos; at = text_.find(key, at + 1)) ++found;
    return found;
  };
  write_and_read(robot);
  EXPECT_EQ(count("mirror_radius_m:"), 1u) << text_;
  EXPECT_EQ(count("apex_rad:"), 1u) << text_;
  EXPECT_EQ(count("tilt_rad:"), 0u) << text_;
  robot.rig.upper.mirror_radius_m += 1e-4;
  write_and_read(robot);
  EXPECT_EQ(count("mirror_radius_m:"), 2u) << text_;
  EXPECT_EQ(count("apex_rad:"), 1u) << text_;
}

TEST_F(RobotWriterTest, TheHeaderStandsInFrontAsComments) {
  write_and_read(read_robot(data("good_robot.yaml")));
  EXPECT_EQ(text_.rfind("# SPDX-License-Identifier: Apache-2.0\n# First line.\n# Second\n# line.\n"
                        "# From good_robot.yaml, whose comments are not kept.\nname: nina\n",
                        0),
            0u)
      << text_;
  EXPECT_NE(text_.find("\nmap: ../"), std::string::npos) << "paths stay relative: " << text_;
}

TEST_F(RobotWriterTest, ACameraInfoStaysWhileItsLensDoes) {
  const fs::path file = folder_ / "robot.yaml";
  std::ofstream(file) << with(read_text(data("good_robot.yaml")), "azimuth_rad: 0.021",
                              "azimuth_rad: 0.021\n    camera_info: lens.yaml");
  std::ofstream(folder_ / "lens.yaml") << read_text(data("good_camera_info.yaml"));
  const Robot robot = read_robot(file);
  const Robot same = write_and_read(robot);
  EXPECT_NE(text_.find("camera_info: ../lens.yaml\n"), std::string::npos) << text_;
  EXPECT_EQ(same.rig.lower.distortion, robot.rig.lower.distortion);

  Robot other = robot;
  other.rig.lower.distortion[0] += 1e-3;
  const Robot changed = write_and_read(other);
  EXPECT_EQ(text_.find("camera_info"), std::string::npos) << text_;
  other.rig.lower.camera_info.clear();
  EXPECT_EQ(changed.rig, other.rig);
}

/// Returns `robot` with a change in everything that robot_text() takes from it.
Robot changed_all_over(const Robot& robot) {
  Robot changed = robot;
  changed.rig.lens_height_m = 1.0 / 3;
  changed.rig.upper.centre_px = {80.1 / 7, 60.3};
  changed.drive.wheel_separation_m = 0.29 / 1.7;
  changed.drive.wheel_radius_m = 0.043 / 1.3;
  changed.lower.settings.width_px = 333;
  changed.lower.settings.height_px = 222;
  changed.lower.antialias = 1;
  changed.upper.settings.width_px = 111;
  changed.upper.settings.height_px = 99;
  changed.upper.antialias = 3;
  for (drivers::CameraPart* camera : {&changed.lower, &changed.upper, &changed.others.at(0).part})
    camera->settings.rate_hz = 31.0 / 3;
  changed.estimator = {.method = "outline",
                       .stage = "adaptive",
                       .landmarks = {"red", "a, b", "3"},
                       .bearings = false,
                       .enough_m = 0.01 / 7,
                       .budget_s = 0.1 / 3};
  return changed;
}

TEST_F(RobotWriterTest, ARobotThatWasChangedReadsBackEqual) {
  const fs::path original = data("good_robot.yaml");
  const fs::path file = folder_ / "out" / "changed.yaml";
  const Robot changed = changed_all_over(read_robot(original));
  const std::string text = robot_text(original, file, changed, {"Changed."});
  std::ofstream(file) << text;
  EXPECT_EQ(as_of(read_robot(file), changed), changed) << text;

  // The way back to the original, which has mostly default values.
  const Robot robot = read_robot(original);
  const std::string back = robot_text(file, file, robot, {});
  EXPECT_EQ(back.find("estimator"), std::string::npos) << back;
  EXPECT_EQ(back.find("antialias: 1"), std::string::npos) << back;
  EXPECT_EQ(as_of(parse_robot(parse_yaml(back, file), file), robot), robot) << back;
}

/// Returns effects of a camera that all differ from the default.
sim_povray::CameraEffects all_effects() {
  return {.gain = 1.2 / 0.7,
          .full_well_electrons = 2e4 / 3,
          .read_noise_electrons = 14.1,
          .vignetting = 0.2 / 3,
          .defocus_px = 1.1 / 3,
          .exposure_time_s = 0.02 / 3,
          .readout_s = 0.01 / 7,
          .shutter_samples = 5,
          .distortion = {0.1 / 3, -0.02, 0.003, 0, 1e-17},
          .distortion_focal_px = 1024.0 / 3,
          .drop_probability = 0.02,
          .late_probability = 0.1 / 3,
          .stamp_late_s = 0.008 / 3,
          .colour_gain = {1.1 / 3, 1, 0.7},
          .flicker = 0.1 / 3,
          .jpeg_quality = 71};
}

Effects all_body_effects() {
  return {.slip = 0.02 / 3,
          .encoder_counts_per_turn = 777,
          .motor_lag_s = 0.1 / 3,
          .wheel_separation_m = 0.3 / 1.01,
          .wheel_radius_m = 0.05 / 1.02,
          .mass_kg = 10.0 / 3,
          .wheel_friction = 0.7 / 3,
          .body_friction = 0};
}

// All effects, none, and those of one camera, for files with many and with few effects.
TEST_F(RobotWriterTest, EffectsReadBackEqual) {
  const fs::path little = folder_ / "little.yaml";
  std::string text = read_text(data("good_robot.yaml"));
  text = with(text, ", effects: {gain: 1.3, defocus_px: 0}", "");
  text = with(text, ", effects: {distortion: []}", "");
  const std::size_t from = text.find("effects:\n");
  std::ofstream(little) << text.erase(from, text.find("max_skew_s") - from);
  const Robot full = read_robot(data("good_robot.yaml"));
  const sim_povray::CameraEffects none;
  for (const fs::path& original : {data("good_robot.yaml"), little}) {
    const Robot robot = read_robot(original);
    for (const auto& [lower, upper, body] :
         {std::tuple(all_effects(), all_effects(), all_body_effects()), std::tuple(none, none, Effects{}),
          std::tuple(none, all_effects(), robot.effects), std::tuple(robot.lower.effects, none, all_body_effects()),
          std::tuple(full.upper.effects, full.lower.effects, full.effects)}) {
      Robot changed = robot;
      changed.lower.effects = lower;
      changed.upper.effects = upper;
      changed.effects = body;
      const fs::path file = folder_ / "once.yaml";
      const std::string once = robot_text(original, file, changed, {});
      std::ofstream(file) << once;
      EXPECT_EQ(as_of(read_robot(file), changed), changed) << once;
      // The way back to the original.
      const std::string back = robot_text(file, file, robot, {});
      EXPECT_EQ(as_of(parse_robot(parse_yaml(back, file), file), robot), robot) << back;
    }
  }
}

TEST_F(RobotWriterTest, EachEffectAloneReadsBackEqual) {
  const auto& [gain, full_well, read_noise, vignetting, defocus_px, exposure_time_s, readout_s, shutter_samples,
               distortion, focal_px, drop, late, stamp_late_s, colour_gain, flicker, jpeg_quality] = all_effects();
  std::vector<sim_povray::CameraEffects> each(14);
  each[0].gain = gain;
  each[1].full_well_electrons = full_well;
  each[2].full_well_electrons = full_well;
  each[2].read_noise_electrons = read_noise;
  each[3].vignetting = vignetting;
  each[4].defocus_px = defocus_px;
  each[5].exposure_time_s = exposure_time_s;
  each[6].readout_s = readout_s;
  each[7].shutter_samples = shutter_samples;  // without effect, and still kept
  each[8].distortion_focal_px = focal_px;
  each[9].drop_probability = drop;
  each[10].stamp_late_s = stamp_late_s;
  each[11].colour_gain = colour_gain;
  each[12].flicker = flicker;
  each[13].jpeg_quality = jpeg_quality;
  const fs::path lab = fs::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml";
  for (const fs::path& original : {data("good_robot.yaml"), lab}) {
    for (const sim_povray::CameraEffects& effects : each) {
      Robot changed = read_robot(original);
      changed.upper.effects = effects;
      text_that_reads_back(original, changed);
    }
  }
}

// Catches a change of one camera that is written for all, and a neutral value that is left out although the common
// value differs.
TEST_F(RobotWriterTest, AnEffectIsWrittenOnlyWhereItDiffers) {
  const fs::path file = folder_ / "robot.yaml";
  std::string original = with(read_text(data("good_robot.yaml")), "    gain: 0.9\n", "    gain: 1.2\n");
  std::ofstream(file) << original;
  const Robot robot = read_robot(file);
  const auto written = [&](const Robot& changed) { return YAML::Load(text_that_reads_back(file, changed)); };
  Robot changed = robot;
  changed.lower.effects.gain = 1;
  YAML::Node node = written(changed);
  EXPECT_EQ(node["cameras"]["lower"]["effects"].size(), 1u);
  EXPECT_EQ(node["cameras"]["lower"]["effects"]["gain"].as<double>(), 1);
  EXPECT_EQ(node["cameras"]["upper"]["effects"].size(), 2u) << "unchanged";
  EXPECT_EQ(node["effects"]["camera"]["gain"].as<double>(), 1.2) << "it applies to the additional camera, too";

  changed = robot;
  changed.upper.effects.gain = 1.2;
  changed.effects.motor_lag_s = 0;
  changed.effects.mass_kg.reset();
  node = written(changed);
  EXPECT_FALSE(node["cameras"]["upper"]["effects"]["gain"]) << "it equals the common value";
  EXPECT_FALSE(node["cameras"]["lower"]["effects"]);
  EXPECT_FALSE(node["effects"]["motor_lag_s"]);
  EXPECT_FALSE(node["effects"]["mass_kg"]);
  changed.upper.effects.defocus_px = 0.8;
  EXPECT_FALSE(written(changed)["cameras"]["upper"]["effects"]) << "the section is empty";
}

TEST_F(RobotWriterTest, EffectsThatTheFileNamesOnceChangeOneByOne) {
  const fs::path file = folder_ / "robot.yaml";
  std::string text = with(read_text(data("good_robot.yaml")), "effects: {gain: 1.3", "effects: &e {gain: 1.3");
  text = with(text, "rate_hz: 12.5, antialias: 2}", "rate_hz: 12.5, antialias: 2, effects: *e}");
  // The anchor must precede its alias.
  const std::size_t lower = text.find("  lower: {driver");
  const std::size_t upper = text.find("  upper: {driver");
  const std::string lower_line = text.substr(lower, upper - lower);
  text.erase(lower, upper - lower);
  text.insert(text.find("  aft_2:"), lower_line);
  std::ofstream(file) << text;
  Robot changed = read_robot(file);
  ASSERT_EQ(changed.lower.effects.gain, 1.3);
  changed.lower.effects.gain = 0.7;
  changed.upper.effects.defocus_px = 0.3;
  text_that_reads_back(file, changed);
}

TEST_F(RobotWriterTest, ARealCameraGetsNoEffects) {
  const fs::path file = folder_ / "robot.yaml";
  std::string text = with(read_text(data("good_robot.yaml")), "upper: {driver: sim_povray",
                          "upper: {driver: v4l2_camera, device: /dev/video0");
  std::ofstream(file) << with(text, ", effects: {gain: 1.3, defocus_px: 0}", "");
  const Robot robot = read_robot(file);
  Robot changed = robot;
  changed.upper.effects.gain = 1.1;
  EXPECT_EQ(message_of([&] { (void)robot_text(file, file, changed, {}); }),
            file.string() +
                ": cameras.upper.effects cannot be changed, must be absent: driver v4l2_camera has no such "
                "setting");
  changed = robot;
  changed.lower.effects.gain = 1.1;
  text_that_reads_back(file, changed);
}

TEST_F(RobotWriterTest, EachEstimatorReadsBackEqual) {
  const fs::path original = data("good_robot.yaml");
  for (const EstimatorKeys& keys :
       {EstimatorKeys{}, EstimatorKeys{.method = "paper", .landmarks = {"x", "y", "z"}},
        EstimatorKeys{.stage = "found"}, EstimatorKeys{.stage = "coarse", .bearings = false},
        EstimatorKeys{.stage = "adaptive", .enough_m = 0.005}}) {
    Robot changed = read_robot(original);
    changed.estimator = keys;
    const std::string text = text_that_reads_back(original, changed);
    EXPECT_EQ(text.find("estimator:") != std::string::npos, keys != EstimatorKeys{}) << text;
  }
}

TEST_F(RobotWriterTest, ASkewThatTheFileLeavesOpenFollowsTheRate) {
  const fs::path file = folder_ / "robot.yaml";
  std::ofstream(file) << with(read_text(data("good_robot.yaml")), "max_skew_s: 0.011\n", "");
  Robot changed = read_robot(file);
  const double skew_s = changed.max_skew_s;
  for (drivers::CameraPart* camera : {&changed.lower, &changed.upper, &changed.others.at(0).part})
    camera->settings.rate_hz /= 2;
  const std::string text = robot_text(file, file, changed, {});
  EXPECT_EQ(text.find("max_skew_s"), std::string::npos);
  EXPECT_EQ(parse_robot(parse_yaml(text, file), file).max_skew_s, 2 * skew_s);
}

// Catches a change of one camera that also changes the other, because the file defines both in one place.
TEST_F(RobotWriterTest, CamerasThatTheFileNamesOnceChangeOneByOne) {
  const fs::path file = folder_ / "robot.yaml";
  std::string text = with(read_text(data("good_robot.yaml")), "lower: {driver", "lower: &one {driver");
  text = with(
      text,
      "upper: {driver: sim_povray, width_px: 322, height_px: 243, rate_hz: 12.5, effects: {gain: 1.3, defocus_px: 0}}",
      "upper: *one");
  std::ofstream(file) << text;
  Robot changed = read_robot(file);
  changed.lower.settings.width_px = 99;
  changed.upper.antialias = 5;
  text_that_reads_back(file, changed);
}

// A camera_info belongs to one image size. For another size, the lens is written as numbers.
TEST_F(RobotWriterTest, ALensOfImagesOfAnotherSizeIsWrittenOut) {
  const fs::path file = folder_ / "robot.yaml";
  std::ofstream(file) << with(read_text(data("good_robot.yaml")), "azimuth_rad: 0.021",
                              "azimuth_rad: 0.021\n    camera_info: lens.yaml");
  std::ofstream(folder_ / "lens.yaml") << read_text(data("good_camera_info.yaml"));
  Robot changed = read_robot(file);
  ASSERT_FALSE(changed.rig.lower.distortion.empty());
  changed.lower.settings.width_px /= 2;
  changed.lower.settings.height_px /= 2;
  changed.rig.lower.distortion_focal_px = {{354.5, 355.5}};
  const std::string text = robot_text(file, file, changed, {});
  changed.rig.lower.camera_info.clear();
  EXPECT_EQ(parse_robot(parse_yaml(text, file), file).rig, changed.rig) << text;
}

TEST_F(RobotWriterTest, ARobotThatWouldBeRejectedIsNotReturned) {
  const fs::path original = data("good_robot.yaml");
  const Robot robot = read_robot(original);
  const auto text_of = [&](const auto& change) {
    Robot changed = robot;
    change(changed);
    return message_of([&] { (void)robot_text(original, "new.yaml", changed, {}); });
  };
  EXPECT_NE(text_of([](Robot& r) { r.lower.settings.width_px = 0; }).find("cameras.lower.width_px is 0 px"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.upper.settings.rate_hz = 7; }).find("cameras.upper.rate_hz is 7 Hz"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.effects.slip = -1; }).find("effects.slip is -1"), std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.upper.effects.stamp_late_s = 0.6; }).find("effects.stamp_late_s is 0.6 s"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.lower.effects.gain = std::nan(""); }).find("cameras.lower.effects.gain is"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.estimator.budget_s = 0.02; }).find("estimator.budget_s is 0.02 s"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.estimator.landmarks = {"red"}; }).find("estimator.landmarks is"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.rig.lower.tilt_rad[0] = 0.9; }).find("rig.lower.tilt_rad[0] is 0.9 rad"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.rig.lens_height_m = std::nan(""); }).find("rig.lens_height_m is"),
            std::string::npos);
  EXPECT_NE(text_of([](Robot& r) { r.drive.wheel_radius_m = 0; }).find("drive.wheel_radius_m is 0 m"),
            std::string::npos);
  EXPECT_NE(message_of([&] { (void)robot_text("nowhere.yaml", "new.yaml", robot, {}); }).find("nowhere.yaml"),
            std::string::npos);
}

}  // namespace
}  // namespace twocone::config
