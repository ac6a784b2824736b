// SPDX-License-Identifier: Apache-2.0
// Compares the truth that POV-Ray renders with the colours in the image, and with rays that the test computes.
#include "tests/sim_povray/reflected_truth.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <ostream>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/scene/scene.h"
#include "tests/support/error_of.h"
#include "tests/support/hyperboloid_mirror.h"
#include "tests/support/value.h"
#include "vision/mirror_view.h"

namespace twocone::sim_povray {
namespace {

using testing_support::value;

// Levels of 16 bits cover the lab's 5.2 m. A mirror that reflects 0.9 of an emission of 0.8 uses 47000 of them, so that
// a level is 0.11 mm. Three rounded levels make a position, with an error of at most one and a half levels in each
// axis.
constexpr double kWithin_m = 0.0003;
// Share of pixels whose centre sees the edge of the shell but not that of the landmark, or the reverse. A landmark's
// outline has a few hundred pixels of 3 mm each, and the shell's 0.1 mm affects about a thirtieth of them.
constexpr double kDifferent = 0.01;

const std::filesystem::path kScenes = std::filesystem::path(TWOCONE_SOURCE_DIR) / "scenes";

PlaceSettings place(const char* scene) {
  PlaceSettings settings{.scene = kScenes / scene};
  settings.scene_paths = {kScenes};  // their maps name the folder `parts` in the same way
  settings.unit_m = 0.05;
  return settings;
}

/// The landmarks of lab.pov, and in kColourBits their colours as bits: 1 red, 2 green, 4 blue.
const std::vector<Landmark> kLabLandmarks{
    {"red", {}, -2.45, -0.35, 0.15, 0.9},    {"green", {}, -1.40, 1.95, 0.15, 0.9},
    {"blue", {}, 1.50, 1.95, 0.15, 0.9},     {"cyan", {}, 2.45, 0.30, 0.15, 0.9},
    {"magenta", {}, 1.30, -1.95, 0.15, 0.9}, {"yellow", {}, -1.50, -1.95, 0.15, 0.9}};
const std::vector<Landmark> kRoomLandmarks{
    {"red", {}, -2.10, -0.40, 0.12, 0.8},    {"green", {}, -1.20, 1.70, 0.12, 0.8},
    {"blue", {}, 1.10, 1.70, 0.12, 0.8},     {"cyan", {}, 2.10, 0.30, 0.12, 0.8},
    {"magenta", {}, 1.40, -1.70, 0.12, 0.8}, {"yellow", {}, -1.60, -1.70, 0.12, 0.8}};
constexpr std::array<int, 6> kColourBits{1, 2, 4, 6, 5, 3};

/// Returns the index of the landmark whose colour a pixel has. Light does not change the saturation of a surface, and
/// without anti-aliasing no pixel mixes two colours.
std::optional<std::size_t> landmark_colour(const DeepImage& image, int column, int row) {
  const std::size_t at = (std::size_t(row) * std::size_t(image.width_px) + std::size_t(column)) * 3;
  const auto [least, greatest] = std::minmax({image.levels[at], image.levels[at + 1], image.levels[at + 2]});
  if (double(least) > 0.1 * double(greatest)) return std::nullopt;
  int bits = 0;
  for (std::size_t i = 0; i < 3; ++i) bits |= image.levels[at + i] > greatest / 2 ? 1 << i : 0;
  const auto* found = std::find(kColourBits.begin(), kColourBits.end(), bits);
  if (found == kColourBits.end()) return std::nullopt;
  return std::size_t(found - kColourBits.begin());
}

/// Returns where a ray first meets an upright cylinder: horizontal distance from the axis of the body frame, and
/// height.
std::optional<Eigen::Vector2d> meets(const vision::Ray& ray, const Eigen::Vector2d& centre_m, double radius_m,
                                     double top_m) {
  const Eigen::Vector2d from = ray.origin_m.head<2>() - centre_m;
  const Eigen::Vector2d along = ray.direction.head<2>();
  const double a = along.squaredNorm();
  const double b = from.dot(along);
  const double root = b * b - a * (from.squaredNorm() - radius_m * radius_m);
  if (root < 0) return std::nullopt;
  const auto at = [&](double t) { return Eigen::Vector3d(ray.origin_m + t * ray.direction); };
  Eigen::Vector3d point = at((-b - std::sqrt(root)) / a);
  if (point.z() > top_m && ray.direction.z() < 0) {
    point = at((top_m - ray.origin_m.z()) / ray.direction.z());
    if ((point.head<2>() - centre_m).norm() > radius_m) return std::nullopt;
  }
  if (point.z() > top_m || point.z() < 0) return std::nullopt;
  return Eigen::Vector2d(point.head<2>().norm(), point.z());
}

struct ConeCase {
  const char* scene;
  vision::MirrorViewSettings mirror;
  const std::vector<Landmark>* landmarks;
  Pose2 pose;

  friend void PrintTo(const ConeCase& c, std::ostream* out) { *out << c.scene; }
};

vision::MirrorViewSettings cone(double apex_rad, double rim_radius_m, double lens_to_tip_m) {
  return {.cone = {.apex_rad = apex_rad, .rim_radius_m = rim_radius_m, .lens_to_tip_m = lens_to_tip_m},
          .lens_height_m = 0.25,
          .centre_px = {159.5, 119.5},
          .rim_radius_px = 118};
}

class ReflectedTruthTest : public testing::TestWithParam<ConeCase> {
 protected:
  const TruthView view_{"lower", 320, 240};
};

INSTANTIATE_TEST_SUITE_P(
    Cones, ReflectedTruthTest,
    testing::Values(ConeCase{"lab.pov", cone(std::numbers::pi / 2, 0.06, 0.12), &kLabLandmarks, {0.413, -0.287, 2.1}},
                    ConeCase{"mirrors/cone120.pov",
                             cone(2 * std::numbers::pi / 3, 0.09, 0.04),
                             &kRoomLandmarks,
                             {-0.317, 0.229, -0.73}}),
    [](const auto& test) { return test.index == 0 ? "Lab" : "Cone120"; });

// Catches a shell that is not at the place of its landmark, and a position that is decoded wrongly: the two
// computations of the truth share only the scene.
TEST_P(ReflectedTruthTest, AgreesWithTheColoursOfTheImageAndWithRays) {
  const ConeCase& c = GetParam();
  const auto settings = place(c.scene);
  const auto truth = value(reflected_truth(settings, {"robot", {}, c.pose}, view_, *c.landmarks));
  std::map<std::pair<int, int>, std::size_t> known_pixels;
  for (const TruePixel& pixel : truth) known_pixels[{pixel.column_px, pixel.row_px}] = pixel.landmark;
  ASSERT_EQ(known_pixels.size(), truth.size()) << "a pixel occurs twice";

  // Colours are compared where the image shows the mirror.
  const auto scene = value(Scene::read(settings.scene));
  const auto robot = scene.object("robot");
  const auto camera = scene.camera("lower");
  ASSERT_TRUE(robot && camera);
  const auto motion = motion_between({}, c.pose);
  const Povray povray(*find_povray("povray"), settings.scene, std::chrono::minutes(1));
  const auto image = value(povray.render_deep(
      "image",
      with_pose(scene.view_template({*robot}, *camera, ""), scene.pose_text({motion}, motion, settings.unit_m)),
      view_.width_px, view_.height_px));
  int coloured = 0;
  int different = 0;
  for (int row = 0; row < view_.height_px; ++row) {
    for (int column = 0; column < view_.width_px; ++column) {
      const Eigen::Vector2d offset = Eigen::Vector2d(column, row) - c.mirror.centre_px;
      if (offset.norm() > c.mirror.rim_radius_px) continue;
      const auto seen = landmark_colour(image, column, row);
      const auto known = known_pixels.find({column, row});
      coloured += seen ? 1 : 0;
      if (seen.has_value() != (known != known_pixels.end()) || (seen && *seen != known->second)) ++different;
    }
  }
  EXPECT_GE(coloured, 1000) << "six landmarks cover more of the image";
  EXPECT_LE(different, kDifferent * coloured);

  // Rays are compared for every pixel of the truth.
  const vision::MirrorView mirror(c.mirror);
  int compared = 0;
  double worst_m = 0;
  for (const TruePixel& pixel : truth) {
    const Landmark& landmark = (*c.landmarks)[pixel.landmark];
    const auto ray = mirror.back_project({pixel.column_px, pixel.row_px});
    if (!ray) continue;  // the rim's outermost pixels
    const double dx = landmark.x_m - c.pose.x_m;
    const double dy = landmark.y_m - c.pose.y_m;
    const Eigen::Vector2d centre_m(std::cos(c.pose.heading_rad) * dx + std::sin(c.pose.heading_rad) * dy,
                                   std::cos(c.pose.heading_rad) * dy - std::sin(c.pose.heading_rad) * dx);
    const auto met = meets(*ray, centre_m, landmark.radius_m, landmark.top_m);
    if (!met) continue;  // the shell's own edge
    const double off_m = std::hypot(met->x() - pixel.distance_m, met->y() - pixel.height_m);
    // A grazing ray meets the shell of 0.1 mm earlier than the landmark, by sqrt(2 * 0.15 m * 0.1 mm) = 5 mm.
    const auto outer = meets(*ray, centre_m, landmark.radius_m + 1e-4, landmark.top_m + 1e-4);
    ASSERT_TRUE(outer);
    const double off_shell_m = std::hypot(outer->x() - pixel.distance_m, outer->y() - pixel.height_m);
    EXPECT_LE(off_shell_m, kWithin_m) << landmark.name << " at pixel " << pixel.column_px << ", " << pixel.row_px;
    EXPECT_LE(off_m, kWithin_m + (*met - *outer).norm());
    worst_m = std::max(worst_m, off_shell_m);
    ++compared;
  }
  EXPECT_GE(compared, 0.98 * double(truth.size()));
  fmt::print("{}: {} coloured pixels, {} different; {} rays compared, worst {:.3f} mm\n", c.scene, coloured, different,
             compared, worst_m * 1000);
}

// Compares the native renderer's truth with POV-Ray's own: the same landmark in the same pixel, as far away.
TEST_P(ReflectedTruthTest, TheNativeRenderersTruthAgrees) {
  const ConeCase& c = GetParam();
  const auto settings = place(c.scene);
  const auto truth = value(reflected_truth(settings, {"robot", {}, c.pose}, view_, *c.landmarks));
  const auto scene = value(Scene::read(settings.scene));
  ViewTemplate view_template = scene.view_template({value(scene.object("robot"))}, value(scene.camera("lower")), "");
  view_template.width_px = view_.width_px;
  view_template.height_px = view_.height_px;
  view_template.carrier = 0;
  view_template.unit_m = settings.unit_m;
  SceneAccess access(settings.scene, settings.scene_paths);
  const auto read = include_reader(access);
  const auto view = value(NativeView::make(view_template, settings.scene.string(), read));
  const auto motion = motion_between({}, c.pose);
  const auto poses = parse_poses(scene.pose_text({motion}, motion, settings.unit_m));
  ASSERT_TRUE(poses);
  auto native = value(view->empty_truth());
  const std::size_t pixels = native.object.size();
  Image image{view_.width_px, view_.height_px, PixelFormat::kRgb8, Bytes(std::vector<std::uint8_t>(3 * pixels))};
  const NativeView::Moment moment = view->at(*poses);
  for (int band = 0; band < view->bands(); ++band) view->render(moment, band, image, &native);

  const vision::MirrorView mirror(c.mirror);
  int different = 0;
  for (const TruePixel& pixel : truth) {
    const auto ray = mirror.back_project({pixel.column_px, pixel.row_px});
    const std::size_t at = std::size_t(pixel.row_px) * std::size_t(view_.width_px) + std::size_t(pixel.column_px);
    if (!ray || native.object[at] == 0) continue;
    const Landmark& landmark = (*c.landmarks)[pixel.landmark];
    const auto& box = (*native.objects)[native.object[at] - 1U].box;
    const bool is_landmark = box && std::abs((box->low_m[0] + box->high_m[0]) / 2 - landmark.x_m) < 0.001 &&
                             std::abs((box->low_m[1] + box->high_m[1]) / 2 - landmark.y_m) < 0.001;
    // The ray of the mirror's model begins at the reflection point, in the robot's frame.
    const Eigen::Vector3d point = ray->origin_m + double(native.distance_m[at]) * ray->direction.normalized();
    const double off_m = std::hypot(point.head<2>().norm() - pixel.distance_m, point.z() - pixel.height_m);
    // A grazing ray meets POV-Ray's shell up to 5 mm before the landmark.
    if (!is_landmark || off_m > 0.006) ++different;
  }
  EXPECT_GE(truth.size(), 1000U);
  EXPECT_LE(different, kDifferent * double(truth.size()));
}

// Compares the hyperbolic mirror of the vision code with that of POV-Ray. The requirement is one pixel. No raster
// limits the comparison, because the truth is that of the pixel's centre.
TEST(ReflectedTruth, AgreesWithTheHyperboloidsProjection) {
  // The truth's error of 0.3 mm at 1.2 m, in an image with 118 px for the rim's slope of 0.68.
  constexpr double kWithin_px = 0.0003 / 1.2 * 118 / 0.68;
  // These are the values of mirrors/hyperboloid.pov.
  const vision::HyperboloidMirror mirror({.half_axis_m = 0.03, .half_focal_m = 0.05, .rim_radius_m = 0.08});
  constexpr double kRim_px = 118;
  constexpr double kLensHeight_m = 0.25;
  const Pose2 pose{0.211, -0.347, 0.9};
  const auto truth = value(
      reflected_truth(place("mirrors/hyperboloid.pov"), {"robot", {}, pose}, {"lower", 320, 240}, kRoomLandmarks));
  EXPECT_GE(truth.size(), 1000U);
  double worst_px = 0;
  for (const TruePixel& pixel : truth) {
    const auto slope = mirror.slope(pixel.distance_m, pixel.height_m - kLensHeight_m);
    const double radius_px = std::hypot(pixel.column_px - 159.5, pixel.row_px - 119.5);
    if (!slope) {
      EXPECT_GT(radius_px, kRim_px - 1) << "only the outermost pixels of the rim";
      continue;
    }
    worst_px = std::max(worst_px, std::abs(*slope / mirror.rim_slope() * kRim_px - radius_px));
  }
  EXPECT_LE(worst_px, kWithin_px);
  fmt::print("{} pixels, worst {:.3f} px\n", truth.size(), worst_px);
}

// Catches a view that takes other robots and moving things at their places in the scene file.
TEST(ReflectedTruth, TakesMovingThingsAtTheirPresentPoses) {
  const auto settings = place("pair/pair.pov");
  const Pose2 first{-0.80, -0.45, 17 * std::numbers::pi / 180};
  const Pose2 trolley{-0.90, 1.10, 0};
  const Pose2 before_red{-1.60, -0.42, 1.3};  // between robot 1 and the red landmark
  const auto pixels_of_red = [&](const Pose2& trolley_now) {
    const auto truth = reflected_truth(settings, {"robot.1", first, first}, {"lower.1", 160, 120}, kRoomLandmarks,
                                       {{"moving.trolley", trolley, trolley_now}});
    EXPECT_TRUE(truth) << truth.error().message;
    return std::count_if(truth->begin(), truth->end(), [](const TruePixel& pixel) { return pixel.landmark == 0; });
  };
  EXPECT_GT(pixels_of_red(trolley), 50);
  EXPECT_EQ(pixels_of_red(before_red), 0);
}

TEST(ReflectedTruth, NoLandmarksNeedNoRendering) {
  PlaceSettings nowhere{.scene = "no such file"};
  const auto truth = value(reflected_truth(nowhere, {"robot", {}, {}}, {"lower", 320, 240}, {}));
  EXPECT_TRUE(truth.empty());
}

TEST(ReflectedTruth, ReportsWhatTheSceneLacks) {
  const auto without = [](const std::string& robot, const std::string& camera) {
    const auto truth = reflected_truth(place("lab.pov"), {robot, {}, {}}, {camera, 320, 240}, kLabLandmarks);
    return truth ? std::string() : truth.error().message;
  };
  EXPECT_THAT(without("robot.3", "lower"), testing::HasSubstr("no object 'robot.3'"));
  EXPECT_THAT(without("robot", "lower.3"), testing::HasSubstr("no camera 'lower.3'"));
}

TEST(ReflectedTruth, NamesEveryBadArgument) {
  auto settings = place("lab.pov");
  settings.unit_m = -0.05;
  const auto call = [&] {
    (void)reflected_truth(settings, {"robot", {}, {}}, {"lower", 0, 20000}, {{"red", {}, 1, NAN, 0, -0.9}});
  };
  EXPECT_EQ(testing_support::error_of<std::invalid_argument>(call),
            "reflected_truth: width_px is 0, must be 1 to 16384; height_px is 20000, must be 1 to 16384; radius_m of "
            "landmark red is 0 m, must be > 0 and finite; top_m of landmark red is -0.9 m, must be > 0 and finite; "
            "landmark red is at (1, nan) m, must be finite; unit_m is -0.05 m, must be > 0 and finite;");
}

// Catches bytes that are read in the machine's order instead of that of the format.
TEST(ReflectedTruth, DeepImagesAreBigEndian) {
  using namespace std::string_literals;
  const auto image = value(parse_deep_ppm("P6\n1 1\n65535\n\x01\x02\xff\xfe\x00\x80"s));
  EXPECT_EQ(image.levels, (std::vector<std::uint16_t>{0x0102, 0xfffe, 0x0080}));
  EXPECT_EQ(parse_deep_ppm("P6\n1 1\n255\nabc").error().message, "255 levels instead of 65535");
  EXPECT_EQ(parse_deep_ppm("P6\n1 1\n65535\nabcde").error().message, "5 bytes of pixels instead of 6");
}

}  // namespace
}  // namespace twocone::sim_povray
