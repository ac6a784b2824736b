// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/scene.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;
using testing_support::FailsWith;

constexpr const char* kCommentedScene =
    "union {\n  //*PMName robot\n  sphere { 0, 1 } // body }\n}\n"
    "camera {\n  //*PMName lower\n  location y // eye\n}\n"
    "camera { location x } // the default, no newline";

Scene parsed(const std::string& text) { return value(Scene::parse(text, "dir/lab.pov")); }

std::string why_no_object(const std::string& text, const std::string& name = "robot") {
  const auto found = parsed(text).object(name);
  if (found) return "found";
  EXPECT_EQ(found.error().code, ErrorCode::kRefused);
  return found.error().message;
}

std::string why_no_camera(const std::string& text, const std::string& name = "lower") {
  const auto found = parsed(text).camera(name);
  if (found) return "found";
  EXPECT_EQ(found.error().code, ErrorCode::kRefused);
  return found.error().message;
}

TEST(Scene, FileErrorsNameTheFile) {
  const TemporaryFolder folder;
  EXPECT_THAT(Scene::read(folder.path() / "none.pov"),
              FailsWith(ErrorCode::kNotFound, HasSubstr("none.pov: no such scene file")));
  EXPECT_THAT(Scene::read(folder.path()), FailsWith(ErrorCode::kRefused));
  EXPECT_THAT(Scene::read(folder.write("broken.pov", "union {\n  sphere {\n}\n")),
              FailsWith(ErrorCode::kRefused, HasSubstr("broken.pov:1:7: this '{' is never closed")));
}

TEST(Scene, KeepsEveryByteOfTheFile) {
  const TemporaryFolder folder;
  const std::string text = "\xEF\xBB\xBF// a\r\nsphere { 0, 1 }\n\x1A";
  const auto scene = value(Scene::read(folder.write("a.pov", text)));
  EXPECT_EQ(scene.text(), text);
}

TEST(Scene, ReportsWhatItSearchedFor) {
  EXPECT_THAT(why_no_object("sphere { 0, 1 }"), AllOf(StartsWith("dir/lab.pov: no object 'robot'"),
                                                      HasSubstr("'//*PMName robot' as the first line inside"),
                                                      HasSubstr("not in files that it includes")));
  EXPECT_THAT(why_no_object(""), AllOf(HasSubstr("no object 'robot'"), HasSubstr("nothing in this file has a name")));
  EXPECT_THAT(why_no_object("union { //*PMName robto\n }\ncamera { //*PMName lower\n }"),
              HasSubstr("names in this file: robto, lower"))
      << "a misspelt name must be visible";
  EXPECT_THAT(why_no_camera(kCommentedScene, "upper"),
              AllOf(HasSubstr("no camera 'upper'"), HasSubstr("//*PMName upper")));
}

TEST(Scene, RefusesWithLineAndReason) {
  EXPECT_THAT(why_no_object("\nunion {\n  sphere { 0, 1 }\n  //*PMName robot\n}"),
              AllOf(StartsWith("dir/lab.pov:4:3: "), HasSubstr("must be the first line inside the braces")));
  EXPECT_THAT(why_no_object("\n#declare R = union {\n  //*PMName robot\n}"),
              AllOf(StartsWith("dir/lab.pov:3:3: "), HasSubstr("must stand at the top level of the file")));
  EXPECT_THAT(why_no_object("camera {\n  //*PMName robot\n}"),
              AllOf(StartsWith("dir/lab.pov:2:3: "), HasSubstr("must be an object"), HasSubstr("'camera'")));
  EXPECT_THAT(why_no_object("texture { //*PMName robot\n}"), HasSubstr("'texture'"));
  EXPECT_THAT(why_no_object("<1> { //*PMName robot\n}"), HasSubstr("a brace without a keyword"));
  EXPECT_THAT(why_no_camera("union {\n  //*PMName lower\n}"),
              AllOf(StartsWith("dir/lab.pov:2:3: "), HasSubstr("must be a camera, but is a 'union'")));
}

TEST(Scene, RefusesTwoOfOneName) {
  const std::string two = "camera {\n  //*PMName lower\n}\n#if (X)\ncamera {\n  //*PMName lower\n}\n#end\n";
  EXPECT_THAT(why_no_camera(two), AllOf(StartsWith("dir/lab.pov:6:3: "), HasSubstr("lines 2, 6")));
}

TEST(Scene, UnusedNamesDoNoHarm) {
  EXPECT_EQ(why_no_object("union { //*PMName robot\n sphere { //*PMName wheel\n } sphere { //*PMName wheel\n } }\n"
                          "#while (X) box { //*PMName crate\n } #end"),
            "found");
}

TEST(Scene, MatrixIsTheIdentityAtTheStart) {
  EXPECT_EQ(matrix(motion_between({0.1, -0.7, 2.9}, {0.1, -0.7, 2.9}), 0.05), "matrix <1,0,0, 0,1,0, 0,0,1, 0,0,0>");
}

// World (x, y, z) is POV-Ray <x, z, y> / unit, and POV-Ray multiplies row vectors. Catches a transposed or mirrored
// rotation.
TEST(Scene, MatrixMovesPointsAsTheWorldDoes) {
  const FloorMotion motion = motion_between({0.31, -0.47, 0.83}, {-1.2, 0.6, -2.1});
  constexpr double kUnit_m = 0.05;
  double m[12];
  ASSERT_EQ(std::sscanf(matrix(motion, kUnit_m).c_str(), "matrix <%lf,%lf,%lf, %lf,%lf,%lf, %lf,%lf,%lf, %lf,%lf,%lf>",
                        &m[0], &m[1], &m[2], &m[3], &m[4], &m[5], &m[6], &m[7], &m[8], &m[9], &m[10], &m[11]),
            12);
  const double x_m = 0.71;
  const double y_m = -0.33;
  const double z_m = 0.25;
  const double row[4] = {x_m / kUnit_m, z_m / kUnit_m, y_m / kUnit_m, 1};
  double moved[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) moved[k] += row[i] * m[3 * i + k];
  }
  constexpr double kTolerance = 1e-13;  // a dozen roundings of numbers below 50
  EXPECT_NEAR(moved[0] * kUnit_m, motion.cos_turn * x_m - motion.sin_turn * y_m + motion.x_m, kTolerance);
  EXPECT_NEAR(moved[2] * kUnit_m, motion.sin_turn * x_m + motion.cos_turn * y_m + motion.y_m, kTolerance);
  EXPECT_NEAR(moved[1] * kUnit_m, z_m, kTolerance);
}

TEST(Scene, TheIdentifierIsOneThatTheSceneDoesNotUse) {
  const Scene scene = parsed(std::string("#declare Twocone_View = 3; #declare Twocone_View_ = 4;\n") + kCommentedScene);
  const std::string frame = scene.view_template({}, *scene.camera("lower"), "").scene;
  EXPECT_THAT(frame, HasSubstr("#declare Twocone__View = camera {"));
  EXPECT_THAT(frame, testing::EndsWith("\ncamera { Twocone__View }\n"));
}

TEST(Scene, AViewTemplateContainsNoPosesAndKeepsEveryLine) {
  const Scene scene = parsed(kCommentedScene);
  const ViewTemplate view_template =
      scene.view_template({*scene.object("robot")}, *scene.camera("lower"), "sphere { 0, 1 }");
  EXPECT_EQ(view_template.scene,
            "union {\n  //*PMName robot\n  sphere { 0, 1 } // body }\n transform { Twocone_X0 } }\n"
            "object { sphere { 0, 1 } transform { Twocone_V } } #declare Twocone_View = camera {\n  //*PMName lower\n  "
            "location y // eye\n transform { Twocone_V } }\n"
            "camera { location x } // the default, no newline\n"
            "camera { Twocone_View }\n");
  EXPECT_EQ(view_template.scene.substr(view_template.pose_offset, 27), " transform { Twocone_X0 } }")
      << "poses are inserted before their first use";
  EXPECT_EQ(std::count(view_template.scene.begin(), view_template.scene.end(), '\n'),
            std::count(kCommentedScene, kCommentedScene + std::strlen(kCommentedScene), '\n') + 2)
      << "lines are added only after the end";
  const FloorMotion away = motion_between({0, 0, 0}, {1, 0, 0});
  EXPECT_EQ(scene.pose_text({away}, {}, 0.05),
            "#declare Twocone_X0 = transform { matrix <1,0,0, 0,1,0, 0,0,1, 20,0,0> } "
            "#declare Twocone_V = transform { matrix <1,0,0, 0,1,0, 0,0,1, 0,0,0> }");
}

TEST(Scene, AViewTemplateWhoseCameraComesFirst) {
  const Scene scene = parsed("camera { //*PMName lower\n}\nunion { //*PMName robot\n}\n");
  const ViewTemplate view_template = scene.view_template({*scene.object("robot")}, *scene.camera("lower"), "");
  EXPECT_EQ(view_template.pose_offset, 0U);
  EXPECT_EQ(view_template.scene,
            "#declare Twocone_View = camera { //*PMName lower\n transform { Twocone_V } }\n"
            "union { //*PMName robot\n transform { Twocone_X0 } }\n\ncamera { Twocone_View }\n");
}

}  // namespace
}  // namespace twocone::sim_povray
