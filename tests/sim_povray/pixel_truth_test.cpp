// SPDX-License-Identifier: Apache-2.0
// What the native renderer says that pixels show, compared with closed forms and with colours.
#include "drivers/sim_povray/pixel_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <ostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Core>

#include "drivers/sim_povray/render/native/native_renderer.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr int kWidth_px = 160, kHeight_px = 120;
constexpr double kUnit_m = 0.05;  // of View::job()
constexpr int kPose = 3;
// A float has 24 bits. Where a ray grazes the floor, rounding of the mirror's point is magnified some hundred times,
// which is still far below this.
constexpr double kRelative = 1e-6;

// Lines count from 1: the plane is in line 5. The robot is at its start in the scene, and is moved by View::job().
constexpr const char* kHead = R"(#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 3 }
#default { finish { ambient 1 diffuse 0 } }
background { color rgb <0.2, 0.2, 0.2> }
plane { y, 0 pigment { color rgb <1, 0, 0> } }
sphere { <12, 5, 7>, 3 pigment { color rgb <0, 1, 0> } }
box { <-17, 0.5, -9>, <-11, 6, -3> pigment { color rgb <0, 0, 1> } }
cylinder { <9, 0, -15>, <9, 12, -15>, 2
  //*PMName post
  pigment { color rgb <1, 1, 0> } }
union {
  //*PMName things
  box { <-2, 0, 14>, <0, 7, 16> pigment { color rgb <0, 1, 1> } }
  difference { sphere { <5, 2, 16>, 2 } sphere { <5, 2, 15>, 1.5 } pigment { color rgb <1, 0, 1> } }
}
)";
constexpr const char* kRobot = R"(
union {
  //*PMName robot
  cone { <0, 0, 0>, 0 <0, 0.96, 0>, 1.2 translate <0, 7.4, 0> pigment { color rgb 0 } finish { ambient 0 %s } }
  torus { 1.4, 0.1 translate <0, 8.6, 0> pigment { color rgb <1, 1, 1> } }
}
camera {
  //*PMName lower
  location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
)";

/// Flat enough for the mirror to show the floor in its middle and the sky at its rim.
constexpr double kMirrorSlope = 1.2 / 0.96;

/// A point in the way of the camera's own rays, in the robot's frame.
constexpr double kBlockerRadius = 0.05;
const Vector3d kBlocker{0.1, 6, -0.07};

/// What a test renders.
struct TruthCase {
  const char* name;
  const char* mirror;  ///< the mirror's finish
  bool has_blocker;    ///< something stands between camera and mirror, so that nothing is planned
  int antialias;

  friend void PrintTo(const TruthCase& c, std::ostream* out) { *out << c.name; }
};

struct Motion {
  double cos_turn = std::cos(0.37 * kPose), sin_turn = std::sin(0.37 * kPose);
  double x = 0.041 * kPose / kUnit_m, z = -0.023 * kPose / kUnit_m;

  [[nodiscard]] Vector3d turned(const Vector3d& d) const {
    return {d.x() * cos_turn - d.z() * sin_turn, d.y(), d.x() * sin_turn + d.z() * cos_turn};
  }
  [[nodiscard]] Vector3d moved(const Vector3d& p) const { return turned(p) + Vector3d(x, 0, z); }
};

struct Expected {
  int object = 0;
  double distance = std::numeric_limits<double>::infinity();
  Vector3d normal = Vector3d::Zero();

  void meet(int number, double t, const Vector3d& surface_normal) {
    if (t <= 1e-9 || t >= distance) return;
    *this = {number, t, surface_normal};
  }
};

void meet_sphere(Expected& seen, int number, const Vector3d& o, const Vector3d& d, const Vector3d& centre,
                 double radius) {
  const double b = (o - centre).dot(d);
  const double root = b * b - (o - centre).squaredNorm() + radius * radius;
  if (root < 0) return;
  const double t = -b - std::sqrt(root);
  seen.meet(number, t, (o + t * d - centre) / radius);
}

/// Meets the plane, the sphere, the box and the cylinder of kHead.
void meet_room(Expected& seen, const Vector3d& o, const Vector3d& d) {
  if (d.y() < 0) seen.meet(1, -o.y() / d.y(), Vector3d::UnitY());
  meet_sphere(seen, 2, o, d, {12, 5, 7}, 3);
  const Vector3d low{-17, 0.5, -9};
  const Vector3d high{-11, 6, -3};
  double enter = 0;
  double leave = std::numeric_limits<double>::infinity();
  Vector3d face = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double near = ((d[i] > 0 ? low : high)[i] - o[i]) / d[i];
    leave = std::min(leave, ((d[i] > 0 ? high : low)[i] - o[i]) / d[i]);
    if (near <= enter) continue;
    enter = near;
    face = Vector3d::Unit(i) * (d[i] > 0 ? -1 : 1);
  }
  if (enter < leave) seen.meet(3, enter, face);
  const double a = d.x() * d.x() + d.z() * d.z();
  const double b = (o.x() - 9) * d.x() + (o.z() + 15) * d.z();
  const double root = b * b - a * ((o.x() - 9) * (o.x() - 9) + (o.z() + 15) * (o.z() + 15) - 4);
  if (root < 0) return;
  const double side = (-b - std::sqrt(root)) / a;
  const Vector3d p = o + side * d;
  if (p.y() > 0 && p.y() < 12) seen.meet(4, side, Vector3d(p.x() - 9, 0, p.z() + 15) / 2);
}

/// Returns what a pixel shows, by the laws of the cone mirror; nothing where it does not show the mirror.
std::optional<Expected> expected_at(int column, int row, bool has_blocker) {
  const Motion motion;
  const Vector3d camera{0, 5, 0};
  const Vector3d d =
      Vector3d(4.0 / 3 * ((column + 0.5) / kWidth_px - 0.5), 1.475, -(0.5 - (row + 0.5) / kHeight_px)).normalized();
  if (has_blocker) {
    Expected direct;
    meet_sphere(direct, 9, motion.moved(camera), motion.turned(d), motion.moved(kBlocker), kBlockerRadius);
    if (direct.object != 0) return direct;
  }
  const double slope = kMirrorSlope;  // the mirror is where the distance from the axis is slope (y - 7.4)
  const double t = 2.4 * slope / (slope * d.y() - std::hypot(d.x(), d.z()));
  const Vector3d p = camera + t * d;
  const double radius = slope * (p.y() - 7.4);
  if (radius < 0 || radius > 1.2) return std::nullopt;
  const Vector3d normal = Vector3d(p.x() / radius, -slope, p.z() / radius).normalized();
  Expected seen;
  meet_room(seen, motion.moved(p), motion.turned(d - 2 * d.dot(normal) * normal));
  return seen;
}

class PixelTruthTest : public testing::TestWithParam<TruthCase> {
 protected:
  std::filesystem::path scene(const std::string& more, const std::string& finish = "reflection 1") {
    std::string robot = kRobot;
    robot.replace(robot.find("%s"), 2, finish);
    const auto path = folder_.path() / "scene.pov";
    std::ofstream(path) << kHead << robot << more;
    return path;
  }
  static View view(const std::filesystem::path& path, int antialias = 1) {
    View result(path, "lower", kWidth_px, kHeight_px, antialias);
    ViewTemplate with_robot = result.view_template();
    with_robot.carrier = 0;
    with_robot.unit_m = kUnit_m;
    result.set(with_robot);
    return result;
  }
  /// Renders the view at kPose.
  static std::pair<ImageResult, PixelTruth> rendered(const std::filesystem::path& path, const View& view,
                                                     std::optional<Reference> reference = {}) {
    NativeRenderer renderer({path, SceneAccess(path, {}), {}, {}, {}}, std::move(reference));
    RenderJob job = view.job(kPose);
    auto expected = renderer.expect_view();
    renderer.prepare(job.view_template, job.pose);
    expected.reset();
    PixelTruth truth;
    job.truth = [&truth](PixelTruth received) { truth = std::move(received); };
    auto image = ordered(renderer, std::move(job)).get();
    return {std::move(image), std::move(truth)};
  }

  TemporaryFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Views, PixelTruthTest,
                         testing::Values(TruthCase{"Planned", "reflection 1", false, 1},
                                         TruthCase{"Smoothed", "reflection 1", false, 3},
                                         TruthCase{"LitMirror", "reflection 0.6 diffuse 0.1 specular 0.2", false, 1},
                                         TruthCase{"SomethingBeforeTheMirror", "reflection 1", true, 1}),
                         [](const auto& test) { return test.param.name; });

// Catches a distance from the camera or along the whole path, a normal in the robot's frame or on the far side, and
// numbers of another order than the text's.
TEST_P(PixelTruthTest, AgreesWithClosedForms) {
  const TruthCase& c = GetParam();
  const Vector3d blocker = Motion{}.moved(kBlocker);
  const auto path = scene(c.has_blocker ? fmt::format("sphere {{ <{}, {}, {}>, {} }}", blocker.x(), blocker.y(),
                                                      blocker.z(), kBlockerRadius)
                                        : "",
                          c.mirror);
  const auto [image, truth] = rendered(path, view(path, c.antialias));
  ASSERT_TRUE(image) << image.error().message;
  ASSERT_EQ(truth.object.size(), std::size_t(kWidth_px) * kHeight_px);
  std::map<int, int> count;
  for (int row = 0; row < kHeight_px; ++row) {
    for (int column = 0; column < kWidth_px; ++column) {
      const auto expected = expected_at(column, row, c.has_blocker);
      if (!expected) continue;
      const std::size_t at = std::size_t(row) * kWidth_px + std::size_t(column);
      if (truth.object[at] == 5 || truth.object[at] == 6) continue;  // compared by their colours below
      ++count[expected->object];
      ASSERT_EQ(truth.object[at], expected->object) << column << ", " << row;
      if (expected->object == 0) {
        EXPECT_EQ(truth.distance_m[at], 0);
        continue;
      }
      ASSERT_NEAR(truth.distance_m[at] / (expected->distance * kUnit_m), 1, kRelative) << column << ", " << row;
      const Vector3d normal(truth.normal[at][0], truth.normal[at][2], truth.normal[at][1]);  // world z is POV-Ray's y
      ASSERT_NEAR((normal - expected->normal).norm(), 0, kRelative) << column << ", " << row;
    }
  }
  for (const int object : {0, 1, 2, 3, 4}) EXPECT_GE(count[object], 20) << "object " << object;
  EXPECT_EQ(count[9] > 0, c.has_blocker);
}

// Catches numbers of neighbouring pixels, of another view's order, and parts of unions that share one.
TEST_F(PixelTruthTest, EachObjectHasTheColourOfItsPixels) {
  const auto path = scene("");
  const auto [image, truth] = rendered(path, view(path));
  ASSERT_TRUE(image) << image.error().message;
  const std::array<std::array<int, 3>, 9> colours{{{124, 124, 124},
                                                   {255, 0, 0},
                                                   {0, 255, 0},
                                                   {0, 0, 255},
                                                   {255, 255, 0},
                                                   {0, 255, 255},
                                                   {255, 0, 255},
                                                   {0, 0, 0},
                                                   {255, 255, 255}}};
  std::map<int, int> count;
  for (std::size_t at = 0; at < truth.object.size(); ++at) {
    const int object = truth.object[at];
    ASSERT_LT(object, 9);
    ++count[object];
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_EQ(int((*image)->bytes[3 * at + i]), colours[std::size_t(object)][i])
          << at % kWidth_px << ", " << at / kWidth_px << ": object " << object;
    }
    if (object == 0) continue;
    const auto& normal = truth.normal[at];
    ASSERT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1, kRelative);
    ASSERT_GT(truth.distance_m[at], 0);
  }
  for (const int object : {0, 1, 2, 3, 4, 5, 6, 8}) EXPECT_GT(count[object], 0) << "object " << object;
  EXPECT_EQ(count[7], 0) << "the mirror itself was not followed";
}

TEST_F(PixelTruthTest, ObjectsAreNamedAsInTheText) {
  const auto path = scene("");
  const auto truth = rendered(path, view(path)).second;
  ASSERT_TRUE(truth.objects);
  std::vector<std::string> got;
  for (const TrueObject& object : *truth.objects) {
    EXPECT_EQ(object.file, path.string());
    got.push_back(fmt::format("{} {} {} {}", object.number, object.kind, object.name, object.line));
  }
  EXPECT_EQ(got, (std::vector<std::string>{"1 plane  5", "2 sphere  6", "3 box  7", "4 cylinder  8", "5 box things 13",
                                           "6 difference things 14", "7 cone robot 19", "8 torus robot 20"}));
  EXPECT_FALSE((*truth.objects)[0].box) << "a plane is infinite";
  ASSERT_TRUE((*truth.objects)[3].box);
  EXPECT_NEAR((*truth.objects)[3].box->low_m[1], -17 * kUnit_m, 1e-6);  // world y is POV-Ray's z
  EXPECT_NEAR((*truth.objects)[3].box->high_m[2], 12 * kUnit_m, 1e-6);
  EXPECT_FALSE((*truth.objects)[6].box) << "the robot moves";
}

// Catches truth that is missing without a word because another renderer took over.
TEST_F(PixelTruthTest, IsRefusedWithTheReasonWherePovrayRenders) {
  const auto path = scene("light_source { <1, 50, 1> rgb 0.2 area_light x, y, 2, 2 }\n");
  const Povray povray(value(find_povray("povray")), path, kRenderLimit);
  const auto image = rendered(path, view(path), Reference{povray, std::make_unique<ProcessRenderer>(povray, 1)}).first;
  EXPECT_THAT(image, FailsWith(ErrorCode::kRefused, HasSubstr("POV-Ray renders, because " + path.string() + ":26: ")));
}

class SimulatedTruthTest : public testing::Test {
 protected:
  SimulatedTruthTest() {
    place_.scene = scene_of_tests("tiny.pov");
    place_.render.renderer = RendererKind::kNative;
    session_.truth = [this](const std::string& camera, std::uint64_t step, PixelTruth truth) {
      const std::lock_guard lock(mutex_);
      received_.emplace_back(camera, step);
      truths_.push_back(std::move(truth));
    };
  }

  PlaceSettings place_;
  SessionSettings session_;
  std::mutex mutex_;
  std::vector<std::pair<std::string, std::uint64_t>> received_;
  std::vector<PixelTruth> truths_;
};

// Catches a truth per shutter sample, one that arrives after its image, and a mask that counts as an object.
TEST_F(SimulatedTruthTest, ComesOnceForEachImageAndBeforeIt) {
  const auto simulation = value(Simulation::open(place_, session_));
  const auto lower = streaming(*simulation, {"lower", 1, {.exposure_time_s = 0.02, .shutter_samples = 5}});
  const auto upper = streaming(*simulation, {"upper", 1, {}});
  for (std::uint64_t step : {0U, 1U}) {
    (void)value(value(lower->grab(kRenderLimit)).image(kRenderLimit));
    (void)value(value(upper->grab(kRenderLimit)).image(kRenderLimit));
    const std::lock_guard lock(mutex_);
    ASSERT_EQ(received_.size(), 2 * step + 2);
    EXPECT_EQ(received_[2 * step], std::pair(std::string("lower"), step));
    EXPECT_EQ(received_[2 * step + 1], std::pair(std::string("upper"), step));
  }
  // The mask stands before the camera's block, so that the two scenes differ in it.
  for (const PixelTruth& truth : truths_) {
    ASSERT_EQ(truth.objects->size(), 7U);
    EXPECT_EQ((*truth.objects)[6].kind, "cone");
    EXPECT_EQ(truth.object.front(), 0) << "a pixel outside the mirror";
    EXPECT_GT(std::ranges::count_if(truth.object, [](int number) { return number > 0; }), 10);
  }
}

TEST_F(SimulatedTruthTest, IsRefusedInAWorldOfPovray) {
  place_.render.renderer = RendererKind::kPovray;
  EXPECT_THAT(Simulation::open(place_, session_), FailsWith(ErrorCode::kRefused, HasSubstr("renderer is povray")));
}

}  // namespace
}  // namespace twocone::sim_povray
