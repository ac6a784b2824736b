// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/mirror_finder.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr int kWidth_px = 160;
constexpr int kHeight_px = 120;

// The rim's radius is 1.2 at 3.6 above the lens: 120 px * 1.475 * 1.2 / 3.6.
constexpr double kRim_px = 59;
constexpr const char* kCone = "cone { <0, 2.4, 0>, 0 <0, 3.6, 0>, 1.2 texture { Silver } }";
constexpr const char* kCamera = "direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>";

/// Returns the text of a scene whose lens is at the origin.
std::string scene_text(const std::string& robot, const std::string& camera, const std::string& room = "") {
  return fmt::format(
      "#version 3.7;\nglobal_settings {{ assumed_gamma 1 }}\n"
      "#declare Silver = texture {{ pigment {{ color rgb 0 }} finish {{ ambient 0 diffuse 0 reflection 0.9 }} }}\n"
      "light_source {{ <10, 60, -20> color rgb 1 }}\nplane {{ y, -5 pigment {{ color rgb 0.4 }} }}\n{}\n"
      "union {{\n  //*PMName robot\n  {}\n  cylinder {{ <0, -5, 0> <0, -2, 0> 3 pigment {{ color rgb 0.2 }} }}\n}}\n"
      "camera {{\n  //*PMName lower\n  {}\n}}\n",
      room, robot, camera);
}

class MirrorFinderTest : public testing::Test {
 protected:
  Result<std::optional<MirrorSight>> find(const std::filesystem::path& path, const std::string& view, int width_px,
                                          int height_px) {
    const auto scene = Scene::read(path);
    if (!scene) return scene.error();
    const Povray povray(find_povray("povray").value(), path, kRenderLimit);
    return find_mirror(povray, *scene, scene->object("robot").value(), scene->camera(view).value(), width_px, height_px,
                       -1);
  }
  MirrorSight sight(const std::string& text, const std::string& name = "scene.pov") {
    return value(find(folder_.write(name, text), "lower", kWidth_px, kHeight_px)).value();
  }
  /// Finds the mirrors of several scenes at once, because POV-Ray mostly sleeps.
  std::vector<MirrorSight> sights(const std::vector<std::string>& texts) {
    std::vector<std::future<MirrorSight>> futures;
    for (const std::string& text : texts) {
      futures.push_back(std::async(std::launch::async, [this, text, number = futures.size()] {
        return sight(text, fmt::format("scene{}.pov", number));
      }));
    }
    std::vector<MirrorSight> result;
    for (auto& future : futures) result.push_back(future.get());
    return result;
  }
  TemporaryFolder folder_;
};

// The outermost pixel centre lies inside the rim by less than a pixel's diagonal; the finder adds half a pixel.
constexpr double kRadius_px = 1;
// The circle goes through outermost pixels on opposite sides, and each of them has this error.
constexpr double kCentre_px = 0.75;

TEST_F(MirrorFinderTest, TheLabsMirrors) {
  for (const char* view : {"lower", "upper"}) {
    const auto found = find(lab_scene(), view, 640, 480);
    ASSERT_TRUE(found && *found) << view;
    const MirrorSight& s = **found;
    EXPECT_NEAR(s.circle.centre.column_px, 319.5, kCentre_px);
    EXPECT_NEAR(s.circle.centre.row_px, 239.5, kCentre_px);
    EXPECT_NEAR(s.circle.radius_px, 236, kRadius_px);
    EXPECT_NE(s.mask, "");
    EXPECT_EQ(s.window.first_row, 0) << "the margin extends beyond the image";
    EXPECT_EQ(s.window.last_row, 479);
    EXPECT_NEAR(s.window.first_column, 319.5 - 236 - kRimMargin_px - kMaskTeeth_px, 2);
    EXPECT_NEAR(s.window.last_column, 319.5 + 236 + kRimMargin_px + kMaskTeeth_px, 2);
  }
}

struct Shape {
  const char* name;
  std::string robot;
  std::string room;
};
void PrintTo(const Shape& s, std::ostream* out) { *out << s.name; }
class Shapes : public MirrorFinderTest, public testing::WithParamInterface<Shape> {};

TEST_P(Shapes, AreFoundToThePixel) {
  const MirrorSight s = sight(scene_text(GetParam().robot, kCamera, GetParam().room));
  EXPECT_NEAR(s.circle.centre.column_px, 79.5, kCentre_px);
  EXPECT_NEAR(s.circle.centre.row_px, 59.5, kCentre_px);
  EXPECT_NEAR(s.circle.radius_px, kRim_px, kRadius_px);
  EXPECT_NE(s.mask, "");
}

INSTANTIATE_TEST_SUITE_P(
    All, Shapes,
    testing::Values(
        Shape{"cone_of_90_degrees", kCone, ""},
        Shape{"cone_of_120_degrees", "cone { <0, 2.907, 0>, 0 <0, 3.6, 0>, 1.2 texture { Silver } }", ""},
        Shape{"hyperboloid",
              "intersection { quadric { <-1/0.49, 1/0.36, -1/0.49>, 0, 0, -1 inverse } cylinder { 0, 1.1907*y, 1.2 } "
              "texture { Silver } translate 2.4093*y }",
              ""},
        Shape{"behind_a_mast",
              std::string(kCone) + " cylinder { <0.9, -1, 0.2> <0.9, 2.9, 0.2> 0.1 pigment { rgb 1 } }", ""},
        // The plate is wider than the mirror, and the mirror's outer part shows only the plate.
        Shape{"under_a_plate_of_shiny_lacquer",
              std::string(kCone) + " box { <-2, 3.7, -3> <2, 3.8, 3> pigment { rgb 0.2 } finish { reflection 0.05 } }",
              ""},
        Shape{"between_near_walls_in_fog", kCone,
              "plane { x, 3.5 pigment { rgb 1 } } plane { z, -3.5 inverse pigment { rgb 1 } } fog { distance 300 color "
              "rgb 0.5 }"}),
    [](const auto& test) { return test.param.name; });

TEST_F(MirrorFinderTest, AMirrorThatTheImageCutsOff) {
  // A mirror farther left and a longer lens: the rim's radius is 88.5 px, and its centre is 30 px off the middle.
  const MirrorSight s = sight(scene_text("object { " + std::string(kCone) + " translate -2.4 * 0.5085 * x / 1.475 }",
                                         "direction <0, 2.2125, 0> up <0, 0, -1> right <4/3, 0, 0>"));
  const double shift_px = 120 * 2.2125 * 2.4 * 0.5085 / 1.475 / 3.6;
  EXPECT_NEAR(s.circle.centre.column_px, 79.5 - shift_px, 1.5);  // fitted to the right half of the rim
  EXPECT_NEAR(s.circle.centre.row_px, 59.5, kCentre_px);
  EXPECT_NEAR(s.circle.radius_px, 1.5 * kRim_px, 1.5);
  EXPECT_EQ(s.window.first_column, 0);
}

TEST_F(MirrorFinderTest, ASceneWithoutAMirrorIsNoError) {
  const auto found = value(find(folder_.write("dull.pov", scene_text("sphere { 4*y, 1 pigment { rgb 1 } }", kCamera)),
                                "lower", kWidth_px, kHeight_px));
  EXPECT_FALSE(found.has_value());
}

TEST_F(MirrorFinderTest, AMistakeInTheSceneIsNamed) {
  const auto path = folder_.write("bad.pov", scene_text("sphere { Bogus }", kCamera));
  EXPECT_THAT(find(path, "lower", kWidth_px, kHeight_px),
              FailsWith(ErrorCode::kRefused, testing::StartsWith(path.string() + ":9: POV-Ray: Parse Error")));
}

// ---- the mask

// The finder tests each mask on a small image and gives no mask if it is wrong.
TEST_F(MirrorFinderTest, MasksForCamerasOfManyKinds) {
  const std::vector<std::string> cameras{
      "location 0 look_at <0, 1, 0> sky <0, 0, 1> angle 48.6",  // a comment }
      "perspective right x*4/3 look_at y*7 angle 2*24.3 /* in any order */ up y*1 sky z",
      "right -x*4/3 up y look_at y*7 angle 48.6 sky <1, 0, 1>",
      "location <0, 0, -3> direction z*1.475 right <4/3, 0, 0> rotate -90*x translate <0, 3, 0>",
      "direction 1.475*z right 4/3*x rotate <-90, 30, 0> scale 0.7 transform { rotate 20*y }",
      "location Eye direction Ahead up <0, 0, -1> right Wide(4)",
  };
  std::vector<std::string> texts;
  for (const std::string& camera : cameras) {
    texts.push_back(scene_text(kCone, camera,
                               "#declare Eye = <0, 0, 0>; #declare Ahead = 1.475*y; #macro Wide(N) <N/3, 0, 0> #end"));
  }
  const auto found = sights(texts);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_NE(found[i].mask, "") << cameras[i];
    EXPECT_NEAR(found[i].circle.radius_px, kRim_px, 2 * kRadius_px) << cameras[i];
  }
}

TEST_F(MirrorFinderTest, NamesThatChangeAfterTheCameraDoNotMoveTheMask) {
  const MirrorSight s =
      sight("#declare Far = 1.475;\n" + scene_text(kCone, "direction <0, Far, 0> up <0, 0, -1> right <4/3, 0, 0>") +
            "#declare Far = 3;\n");
  EXPECT_NE(s.mask, "");
}

TEST_F(MirrorFinderTest, AMissingMaskIsExplained) {
  struct Case {
    std::string camera, room, why;
  };
  const std::vector<Case> cases{
      {"orthographic direction y up -4*z right 5*x", "", "'orthographic'"},
      {"Eye", "#declare Eye = camera { direction 1.475*y up -z right 4/3*x }", "'Eye'"},
      {std::string(kCamera) + " aperture 0.001 blur_samples 4 focal_point 3*y", "", "'aperture'"},
      {std::string("#if (1) ") + kCamera + " #end", "", "a #if"},
      {kCamera, "#version 3.1;", "#version is below 3.5"},
      {"direction 9*y up -z right 4/3*x", "", "fills the image"},
  };
  std::vector<std::string> texts;
  for (const Case& c : cases) texts.push_back(scene_text(kCone, c.camera, c.room));
  const auto found = sights(texts);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    EXPECT_EQ(found[i].mask, "") << cases[i].camera;
    const Scene scene = Scene::parse(texts[i], "scene.pov").value();
    Circle circle = found[i].circle;
    circle.radius_px += kRimMargin_px;
    EXPECT_THAT(camera_mask(scene, scene.camera("lower").value(), circle, kWidth_px, kHeight_px),
                FailsWith(ErrorCode::kRefused, HasSubstr(cases[i].why)))
        << cases[i].camera;
  }
}

// The mask hides everything outside the mirror and changes no pixel inside it.
TEST_F(MirrorFinderTest, TheLabsMirrorsLookTheSameThroughTheMask) {
  constexpr int kLabWidth_px = 320;
  constexpr int kLabHeight_px = 240;
  const Scene scene = Scene::read(lab_scene()).value();
  ProcessRenderer renderer(Povray(find_povray("povray").value(), lab_scene(), kRenderLimit), 4);
  for (const char* name : {"lower", "upper"}) {
    const auto found = find(lab_scene(), name, kLabWidth_px, kLabHeight_px);
    ASSERT_TRUE(found && *found);
    const MirrorSight& s = **found;
    const NamedBlock robot = scene.object("robot").value();
    const NamedBlock camera = scene.camera(name).value();
    View whole(lab_scene(), name, kLabWidth_px, kLabHeight_px);
    View masked = whole;
    ViewTemplate view_template = scene.view_template({robot}, camera, s.mask);
    view_template.width_px = kLabWidth_px;
    view_template.height_px = kLabHeight_px;
    view_template.window = s.window;
    masked.set(view_template);
    const auto expected = images(renderer, {whole}, 2);
    const auto got = images(renderer, {masked}, 2);
    for (std::size_t i = 0; i < got.size(); ++i) {
      ASSERT_TRUE(got[i] && expected[i]);
      int different = 0, light = 0;
      for (int row = 0; row < kLabHeight_px; ++row) {
        for (int column = 0; column < kLabWidth_px; ++column) {
          const double off =
              std::hypot(column - s.circle.centre.column_px, row - s.circle.centre.row_px) - s.circle.radius_px;
          for (int k = 0; k < 3; ++k) {
            const auto at = std::size_t(3 * (row * kLabWidth_px + column) + k);
            if (off < kRimMargin_px - 0.5 && (*got[i])->bytes[at] != (*expected[i])->bytes[at]) ++different;
            if (off > kRimMargin_px + kMaskTeeth_px + 0.5 && (*got[i])->bytes[at] != 0) ++light;
          }
        }
      }
      EXPECT_EQ(different, 0) << name << ", pose " << i;
      EXPECT_EQ(light, 0) << name << ", pose " << i;
    }
  }
}

// Catches a mask whose edge could be taken for a rim. No part of the lab is black there. A rim finder requires a third
// of the directions within a pixel of a circle.
TEST_F(MirrorFinderTest, TheMasksEdgeLiesOnNoCircle) {
  constexpr int kSide_px = 320;
  constexpr int kDirections = 360;
  const Scene scene = Scene::read(lab_scene()).value();
  const NamedBlock camera = scene.camera("lower").value();
  const Circle circle{{158.3, 161.2}, 124};
  const auto mask = value(camera_mask(scene, camera, circle, kSide_px, kSide_px));
  ViewTemplate view_template = scene.view_template({scene.object("robot").value()}, camera, mask);
  view_template.width_px = kSide_px;
  view_template.height_px = kSide_px;
  const auto image = value(Povray(find_povray("povray").value(), lab_scene(), kRenderLimit)
                               .render({"the mask", std::make_shared<const ViewTemplate>(view_template),
                                        scene.pose_text({FloorMotion{}}, FloorMotion{}, 1)},
                                       -1));
  std::vector<double> ends_px;
  for (int i = 0; i < kDirections; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / kDirections;
    for (double r = circle.radius_px + kMaskTeeth_px + 4; r > circle.radius_px - 4; r -= 0.25) {
      const auto column = int(std::lround(circle.centre.column_px + r * std::cos(angle_rad)));
      const auto row = int(std::lround(circle.centre.row_px + r * std::sin(angle_rad)));
      const auto at = std::size_t(3 * (row * kSide_px + column));
      if (image->bytes[at] + image->bytes[at + 1] + image->bytes[at + 2] == 0) continue;
      ends_px.push_back(r);
      break;
    }
  }
  ASSERT_EQ(ends_px.size(), std::size_t(kDirections));
  EXPECT_GT(*std::min_element(ends_px.begin(), ends_px.end()), circle.radius_px - 1);
  EXPECT_LT(*std::max_element(ends_px.begin(), ends_px.end()), circle.radius_px + kMaskTeeth_px + 1);
  for (double r = circle.radius_px - 2; r < circle.radius_px + kMaskTeeth_px + 2; r += 0.25) {
    const auto near = std::count_if(ends_px.begin(), ends_px.end(), [r](double end) { return std::abs(end - r) <= 1; });
    EXPECT_LT(double(near) / kDirections, 1.0 / 3) << r << " px";
  }
}

}  // namespace
}  // namespace twocone::sim_povray
