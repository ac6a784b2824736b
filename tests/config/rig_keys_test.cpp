// SPDX-License-Identifier: Apache-2.0
// Checks the keys of `rig:` for mirrors that are tilted or off the axis, and for lenses.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/keys/robot_keys.h"
#include "apps/config/robot_file.h"
#include "tests/config/fixtures.h"
#include "tests/support/temporary_folder.h"

namespace twocone::config {
namespace {

namespace fs = std::filesystem;
using testing_support::TemporaryFolder;

constexpr const char* kTilt = "    tilt_rad: [0.011, -0.007]\n";
/// Reads the text as a file beside good_robot.yaml, so that relative paths start at its folder.
Robot robot_beside_the_good_one(const std::string& text) {
  return parse_robot(parse_yaml(text, "robot.yaml"), data("robot.yaml"));
}
/// Inserts lines in the upper mirror's section, from line 34 on.
std::string with_upper(const std::string& lines) { return with(good_robot_text(), kTilt, lines); }
/// Inserts lines in `rig:`, from line 23 on.
std::string with_common(const std::string& lines) {
  return with(good_robot_text(), "  lens_height_m: 0.23\n", "  lens_height_m: 0.23\n" + lines);
}

TEST(RigKeys, TiltAndOffsetAreOfOneMirrorOrOfBoth) {
  const Rig rig =
      robot_beside_the_good_one(with_common("  tilt_rad: [0.01, 0.02]\n  axis_offset_m: [0.003, -0.004]\n")).rig;
  EXPECT_EQ(rig.lower.tilt_rad, (std::array{0.01, 0.02}));
  EXPECT_EQ(rig.upper.tilt_rad, (std::array{0.011, -0.007})) << "its own value overrides";
  EXPECT_EQ(rig.lower.axis_offset_m, (std::array{0.003, -0.004}));
  EXPECT_EQ(rig.upper.axis_offset_m, (std::array{0.003, -0.004}));
}

TEST(RigKeys, TimesOfExposureAreOfOneViewOrOfBoth) {
  const Rig rig = robot_beside_the_good_one(with_upper("    late_s: -0.0125\n")).rig;
  EXPECT_EQ(rig.lower.late_s, 0);
  EXPECT_EQ(rig.upper.late_s, -0.0125);
  const Rig both = robot_beside_the_good_one(with_common("  readout_s: 0.03\n")).rig;
  EXPECT_EQ(both.lower.readout_s, 0.03);
  EXPECT_EQ(both.upper.readout_s, 0.03);
}

TEST(RigKeys, ALensComesWithItsFocalLengthAndMiddle) {
  const Rig rig = robot_beside_the_good_one(with_upper("    distortion: [0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6]\n"
                                                       "    distortion_focal_px: [701.25, 698.5]\n"
                                                       "    distortion_principal_px: [162.5, 121.5]\n"))
                      .rig;
  EXPECT_EQ(rig.upper.distortion, (std::vector{0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6}));
  EXPECT_EQ(rig.upper.distortion_focal_px, (std::array{701.25, 698.5}));
  EXPECT_EQ(rig.upper.distortion_principal_px, (std::array{162.5, 121.5}));
  EXPECT_TRUE(rig.lower.distortion.empty());
  const Rig square =
      robot_beside_the_good_one(with_upper("    distortion: [0.1, 0, 0, 0]\n    distortion_focal_px: 701.25\n")).rig;
  EXPECT_EQ(square.upper.distortion_focal_px, (std::array{701.25, 701.25})) << "one number sets both, as in effects";
  EXPECT_TRUE(robot_beside_the_good_one(with_upper("    distortion: []\n")).rig.upper.distortion.empty());
}

TEST(RigKeys, ACameraInfoFileGivesTheLens) {
  const std::string text =
      with(good_robot_text(), "azimuth_rad: 0.021", "azimuth_rad: 0.021\n    camera_info: good_camera_info.yaml");
  const Rig rig = robot_beside_the_good_one(text).rig;
  EXPECT_EQ(rig.lower.camera_info, data("good_camera_info.yaml"));
  EXPECT_EQ(rig.lower.distortion, (std::vector{-0.21, 0.07, 0.0013, -0.0021, -0.013}));
  EXPECT_EQ(rig.lower.distortion_focal_px, (std::array{701.25, 698.5}));
  EXPECT_EQ(rig.lower.distortion_principal_px, (std::array{322.75, 243.125}));
  EXPECT_TRUE(rig.upper.camera_info.empty());
}

TEST(RigKeys, AMirrorsOwnLensTakesThePlaceOfTheCommonOne) {
  const Rig own_numbers = robot_beside_the_good_one(with(with_common("  camera_info: good_camera_info.yaml\n"), kTilt,
                                                         "    distortion: [0.1, 0.2, 0.01, 0.02]\n"))
                              .rig;
  EXPECT_TRUE(own_numbers.upper.camera_info.empty());
  EXPECT_EQ(own_numbers.upper.distortion, (std::vector{0.1, 0.2, 0.01, 0.02}));
  EXPECT_FALSE(own_numbers.upper.distortion_focal_px.has_value());
  EXPECT_EQ(own_numbers.lower.camera_info, data("good_camera_info.yaml"));
  const Rig own_file =
      robot_beside_the_good_one(with(with_common("  distortion: [0.1, 0.2, 0.01, 0.02]\n"), "azimuth_rad: 0.021",
                                     "azimuth_rad: 0.021\n    camera_info: good_camera_info.yaml"))
          .rig;
  EXPECT_EQ(own_file.lower.distortion.size(), 5u);
  EXPECT_EQ(own_file.upper.distortion.size(), 4u);
}

TEST(RigKeys, ThroughANodeOfAnotherFileTheLensIsTheSame) {
  const TemporaryFolder folder;
  const fs::path file = folder.write(
      "robot.yaml", with(with_common("  camera_info: lens.yaml\n"), kTilt, "    distortion: [0.1, 0.2, 0.01, 0.02]\n"));
  (void)folder.write("lens.yaml", read_text(data("good_camera_info.yaml")));
  const Robot direct = read_robot(file);
  YAML::Node run;
  run["robot"] = load_robot_node(direct);
  const Robot again = parse_robot(YAML::Load(YAML::Dump(run))["robot"], "/elsewhere/run.yaml");
  EXPECT_EQ(again.rig, direct.rig);
  EXPECT_TRUE(again.rig.lower.camera_info.is_absolute());
}

class BadRigKey : public testing::TestWithParam<BadCase> {};

TEST_P(BadRigKey, IsRefusedInTheseWords) {
  const std::string text = with(good_robot_text(), GetParam().find, GetParam().replace);
  EXPECT_EQ(message_of([&] { parse_robot(parse_yaml(text, "robot.yaml"), "robot.yaml"); }), GetParam().message);
}

const BadCase kBadRigKeys[] = {
    {"TiltInDegrees", "[0.011, -0.007]", "[0.011, 5]",
     "robot.yaml:34: rig.upper.tilt_rad[1] is 5 rad, must be > -pi/4 and < pi/4"},
    {"ThreeTilts", "[0.011, -0.007]", "[0.011, 0, 0]",
     "robot.yaml:34: rig.upper.tilt_rad is [0.011, 0, 0] rad, must be a list of 2 numbers (radians)"},
    {"OffsetIsNoNumber", "lens_height_m: 0.23", "lens_height_m: 0.23\n  axis_offset_m: [left, 0]",
     "robot.yaml:23: rig.axis_offset_m[0] is 'left', must be a number (metres)"},
    {"LateInMilliseconds", "lens_height_m: 0.23", "lens_height_m: 0.23\n  late_s: 12",
     "robot.yaml:23: rig.late_s is 12 s, must be -0.5 to 0.5"},
    {"SixCoefficients", "tilt_rad: [0.011, -0.007]", "distortion: [1, 2, 3, 4, 5, 6]",
     "robot.yaml:34: rig.upper.distortion is a list of 6, must be a list of 0 or 4 or 5 or 8 numbers"},
    {"FocalLengthWithoutALens", "tilt_rad: [0.011, -0.007]", "distortion_focal_px: [700, 700]",
     "robot.yaml:34: rig.upper.distortion_focal_px is [700, 700] px, must be absent without distortion"},
    {"NoFocalLength", "tilt_rad: [0.011, -0.007]", "distortion: [0.1, 0, 0, 0]\n    distortion_focal_px: [700, 0]",
     "robot.yaml:35: rig.upper.distortion_focal_px[1] is 0 px, must be > 0"},
    {"FocalLengthOfAWord", "tilt_rad: [0.011, -0.007]", "distortion: [0.1, 0, 0, 0]\n    distortion_focal_px: long",
     "robot.yaml:35: rig.upper.distortion_focal_px is 'long', must be a number or a list of 2 numbers "
     "(pixels)"},
    {"TwoLenses", "tilt_rad: [0.011, -0.007]", "distortion: [0.1, 0, 0, 0]\n    camera_info: good_camera_info.yaml",
     "robot.yaml:35: rig.upper.camera_info is 'good_camera_info.yaml', must be absent beside distortion"},
    {"NoSuchFile", "tilt_rad: [0.011, -0.007]", "camera_info: nowhere.yaml", "nowhere.yaml: no such file"}};

INSTANTIATE_TEST_SUITE_P(All, BadRigKey, testing::ValuesIn(kBadRigKeys), name_of<BadCase>);

TEST(RigKeys, ACameraInfoOfAnotherImageIsRefusedWithItsOwnLines) {
  const fs::path file = data("good_camera_info.yaml");
  const std::string message =
      message_of([&] { robot_beside_the_good_one(with_upper("    camera_info: good_camera_info.yaml\n")); });
  EXPECT_EQ(message, fmt::format("{0}:2: image_width is 641 px, must be 322, that of cameras.upper of {1}\n"
                                 "{0}:3: image_height is 479 px, must be 243, that of cameras.upper of {1}",
                                 file.string(), data("robot.yaml").string()));
}

/// Returns the lens data of a calibration file of images of the size in good_camera_info.yaml.
RigView lens_of(const fs::path& file) {
  drivers::CameraPart camera;
  camera.settings.width_px = 641;
  camera.settings.height_px = 479;
  RigView view;
  view.camera_info = file;
  read_camera_info(camera, "it", view);
  return view;
}

/// Returns the error message of read_camera_info for the good file with one change.
std::string complaint(const std::string& find, const std::string& replace) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("lens.yaml", with(read_text(data("good_camera_info.yaml")), find, replace));
  std::string message = message_of([&] { (void)lens_of(file); });
  const std::size_t at = message.find(file.string());
  return at == std::string::npos ? message : message.replace(at, file.string().size(), "F");
}

TEST(CameraInfo, CoefficientsOfNoKnownLensAreRejected) {
  EXPECT_EQ(complaint("plumb_bob", "plumb_bob"), "no error");
  EXPECT_EQ(complaint("plumb_bob", "equidistant"),
            "F:9: distortion_model is 'equidistant', must be plumb_bob or rational_polynomial");
  EXPECT_EQ(complaint("[701.25, 0., 322.75,", "[701.25, 0.3, 322.75,"),
            "F:8: camera_matrix.data is a list of 9, must be [fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx and fy > 0 "
            "(pixels)");
  EXPECT_EQ(complaint("-0.013]", "-0.013, 1, 2, 3]"),
            "F:13: distortion_coefficients.data is a list of 8, must be a list of 0 or 4 or 5 numbers");
  EXPECT_EQ(complaint("cols: 5", "cols: 4"), "F:12: distortion_coefficients.cols is 4, must be 5, as many as data has");
  EXPECT_EQ(complaint("image_width: 641\n", ""), "F:2: image_width is missing: width of the image, pixels");
  EXPECT_NE(complaint("camera_name", "camera_nane").find("camera_nane"), std::string::npos);
}

TEST(CameraInfo, TheRationalModelHasEightAndAllZerosAreNoLens) {
  const TemporaryFolder folder;
  std::string text = with(read_text(data("good_camera_info.yaml")), "plumb_bob", "rational_polynomial");
  text = with(with(text, "cols: 5", "cols: 8"), "-0.013]", "-0.013, 0.5, -0.1, 0.02]");
  EXPECT_EQ(lens_of(folder.write("rational.yaml", text)).distortion,
            (std::vector{-0.21, 0.07, 0.0013, -0.0021, -0.013, 0.5, -0.1, 0.02}));
  text = with(read_text(data("good_camera_info.yaml")), "[-0.21, 0.07, 0.0013, -0.0021, -0.013]", "[0, 0.0, 0, 0, 0]");
  EXPECT_TRUE(lens_of(folder.write("zeros.yaml", text)).distortion.empty());
}

}  // namespace
}  // namespace twocone::config
