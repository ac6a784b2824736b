// SPDX-License-Identifier: Apache-2.0
#include "apps/design/design.h"

#include <cmath>
#include <numbers>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/design/output.h"
#include "apps/design/sight.h"
#include "drivers/sim_povray/scene_geometry.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::design {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing_support::TemporaryFolder;

constexpr double kDegree = std::numbers::pi / 180;
/// Measures are rounded to half a millimetre and a tenth of a degree.
constexpr double kRounding_rad = 0.15 * kDegree;

Sight sight_of(const config::Robot& robot) { return Sight(config::to_rig(robot)); }

config::Robot built(const Requirements& requirements, const TemporaryFolder& folder) {
  const Files files = files_in(folder.path(), "required");
  write_robot(design(requirements), std::nullopt, files);
  return config::read_robot(files.robot);
}

void expect_fulfilled(const Requirements& requirements, const config::Robot& robot) {
  const Sight sight = sight_of(robot);
  for (const auto* view : {&sight.rig().lower, &sight.rig().upper}) {
    EXPECT_LE(elevations_of(*view).lowest_rad, requirements.lowest_rad + kRounding_rad);
    EXPECT_GE(elevations_of(*view).highest_rad, requirements.highest_rad - kRounding_rad);
    EXPECT_LE(view->settings().cone.rim_radius_m, requirements.greatest_radius_m + 1e-9);
    EXPECT_LE(view->settings().rim_radius_px, std::min(requirements.width_px, requirements.height_px) / 2.0);
  }
  const auto shared = sight.shared_heights(requirements.at_m);
  ASSERT_TRUE(shared);
  for (int k = 0; k <= 10; ++k) {
    const auto sigma_m = sight.range_sigma_m(
        requirements.at_m, std::lerp(shared->lowest_m, shared->highest_m, (k + 0.01) / 10.02), requirements.sigma_px);
    ASSERT_TRUE(sigma_m);
    EXPECT_LE(*sigma_m, 1.01 * requirements.sigma_m);
  }
  if (requirements.floor_from_m) {
    ASSERT_TRUE(sight.floor_from_m());
    EXPECT_LE(*sight.floor_from_m(), *requirements.floor_from_m);
  }
  const auto& cone = sight.rig().upper.settings().cone;
  EXPECT_LE(sight.rig().upper.tip_m().z() + cone.rim_radius_m / std::tan(cone.apex_rad / 2) + kPlate_m,
            requirements.greatest_height_m + 1e-9);
  // The upper camera is above the lower mirror.
  EXPECT_GE(sight.rig().upper.lens_m().z() - kCamera_m,
            sight.rig().lower.tip_m().z() + cone.rim_radius_m / std::tan(cone.apex_rad / 2) + kPlate_m - 1e-3);
}

std::vector<Requirements> requirements_that_can_be_met() {
  std::vector<Requirements> all(5);
  all[1].lowest_rad = 1 * kDegree;
  all[1].highest_rad = 15 * kDegree;
  all[2].camera_angle_rad = 61.7 * kDegree;
  all[2].lowest_rad = -19 * kDegree;
  all[2].highest_rad = 6 * kDegree;
  all[2].lens_height_m = 0.14;
  all[2].floor_from_m = 1.2;
  all[3].sigma_m = 0.007;
  all[3].greatest_height_m = 1.1;
  all[4].width_px = 1296;
  all[4].height_px = 972;
  all[4].greatest_radius_m = 0.04;
  return all;
}

TEST(Design, DoesWhatIsRequired) {
  const TemporaryFolder folder;
  for (const Requirements& requirements : requirements_that_can_be_met())
    expect_fulfilled(requirements, built(requirements, folder));
}

TEST(Design, TakesLargeMirrorsAndTheLeastSeparation) {
  Requirements requirements;
  const Design usual = design(requirements);
  EXPECT_NEAR(usual.mirror_radius_m, requirements.greatest_radius_m, 1e-9);
  requirements.sigma_m = 0.006;
  const Design accurate = design(requirements);
  EXPECT_GT(accurate.mirror_separation_m, usual.mirror_separation_m);
  requirements.sigma_m = 1;
  EXPECT_LE(design(requirements).mirror_separation_m, usual.mirror_separation_m);
}

/// Requirements that cannot be, and what the refusal begins with.
struct Refusal {
  Requirements requirements;
  std::string reason;
};
std::vector<Refusal> refusals() {
  std::vector<Refusal> all(5);
  all[0].requirements.lowest_rad = -10 * kDegree;
  all[0].requirements.highest_rad = 40 * kDegree;
  all[0].reason = "elevations from -10 to 40 degrees are a band of 50 degrees";
  all[1].requirements.sigma_m = 0.0041;
  all[1].reason = "a range at 3 m can have a sigma of";
  all[2].requirements.floor_from_m = 0.7;
  all[2].reason = "both mirrors see the floor from";
  all[3].requirements.greatest_height_m = 0.37;
  all[3].reason = "two mirrors with their cameras over a lens at 250 mm are higher than 370 mm";
  all[4].requirements.camera_angle_rad = 120 * kDegree;
  all[4].requirements.lowest_rad = -20 * kDegree;
  all[4].requirements.highest_rad = 5 * kDegree;
  all[4].reason = "a mirror of radius 60 mm and 132.2 degrees would be 9.0 mm from the lens";
  return all;
}

/// Returns the number that follows a text in a message.
double number_after(const std::string& message, const std::string& text) {
  std::smatch found;
  const std::regex number(text + R"(\s*(-?[0-9.]+))");
  EXPECT_TRUE(std::regex_search(message, found, number)) << text << " in: " << message;
  return found.empty() ? NAN : std::stod(found[1]);
}

TEST(Design, RefusesWhatCannotBeAndTheNearestThatItNamesCan) {
  const TemporaryFolder folder;
  const std::vector<Refusal> all = refusals();
  std::vector<std::string> messages;
  for (const Refusal& refusal : all) {
    messages.push_back(testing_support::error_of<CannotBe>([&] { (void)design(refusal.requirements); }));
    EXPECT_THAT(messages.back(), AllOf(HasSubstr(refusal.reason), HasSubstr("; nearest: "), Not(HasSubstr("\n"))));
  }
  const auto expect_met = [&](std::size_t k, auto Requirements::*what, const std::string& words, double unit) {
    Requirements near = all[k].requirements;
    near.*what = number_after(messages[k], words) * unit;
    expect_fulfilled(near, built(near, folder));
  };
  constexpr double kMillimetre_m = 0.001;
  expect_met(0, &Requirements::highest_rad, "a highest elevation of", kDegree);
  expect_met(1, &Requirements::greatest_height_m, "a greatest height of", kMillimetre_m);
  expect_met(1, &Requirements::sigma_m, "nearest:", kMillimetre_m);
  expect_met(2, &Requirements::floor_from_m, "nearest:", 1);
  expect_met(3, &Requirements::greatest_height_m, "a greatest height of", kMillimetre_m);
  expect_met(4, &Requirements::greatest_radius_m, "nearest: mirrors of radius", kMillimetre_m);
  expect_met(4, &Requirements::camera_angle_rad, "or a camera of", kDegree);
}

TEST(Design, RefusesRequirementsOutsideTheirDomain) {
  Requirements requirements;
  requirements.sigma_m = 0;
  requirements.width_px = 7;
  requirements.highest_rad = requirements.lowest_rad;
  EXPECT_THAT(testing_support::error_of<std::invalid_argument>([&] { (void)design(requirements); }),
              AllOf(HasSubstr("sigma_m is 0 m"), HasSubstr("width_px is 7"), HasSubstr("the lowest first")));
}

TEST(Design, ItsSceneShowsTheLandmarksAndTheMirrorsOfItsFiles) {
  const TemporaryFolder folder;
  const config::Robot robot = built({}, folder);
  const config::Map map = config::read_map(robot.map);
  const auto geometry = sim_povray::SceneGeometry::read(
      {.scene = map.scene.value(), .scene_paths = map.scene_paths, .unit_m = map.unit_m});
  ASSERT_TRUE(geometry) << geometry.error().message;
  for (const Landmark& landmark : map.landmarks) {
    const auto cylinders = geometry->upright_cylinders();
    EXPECT_TRUE(std::ranges::any_of(cylinders, [&](const auto& cylinder) {
      return std::hypot(cylinder.x_m - landmark.x_m, cylinder.y_m - landmark.y_m) < 1e-6 &&
             std::abs(cylinder.top_m - landmark.top_m) < 1e-6;
    })) << landmark.name;
    // Both mirrors show it from somewhere near and from somewhere far.
    const Sight sight = sight_of(robot);
    for (const double distance_m : {1.5, 3.0}) {
      EXPECT_TRUE(sight.shows(vision::Side::kLower, distance_m - landmark.radius_m, landmark.top_m));
      EXPECT_TRUE(sight.shows(vision::Side::kUpper, distance_m - landmark.radius_m, landmark.top_m));
    }
  }
}

TEST(Design, ItsProfileIsHalfOfTheMirrorInMillimetres) {
  const Design made = design({});
  const std::string dxf = profile_dxf(made);
  EXPECT_THAT(dxf, HasSubstr("AC1009"));
  EXPECT_THAT(dxf, HasSubstr(fmt::format("0\nLINE\n8\nMIRROR\n10\n0.0000\n20\n0.0000\n30\n0\n11\n{:.4f}\n21\n{:.4f}\n",
                                         1000 * made.mirror_radius_m, 1000 * made.cone_height_m())));
  EXPECT_TRUE(dxf.ends_with("0\nEOF\n"));
}

TEST(Design, ItsDataHoldWhatItsTableSays) {
  const TemporaryFolder folder;
  Result result;
  result.robot = built({}, folder);
  result.map = config::read_map(result.robot.map);
  result.settings.room_step_m = 0.5;
  result.analysis = analyse(result.robot, result.map, result.settings);
  const auto json = design_json(result);
  EXPECT_NEAR(json["rig"]["mirror_separation_m"].get<double>(), result.robot.rig.mirror_separation_m, 1e-12);
  EXPECT_EQ(json["room"]["map"]["landmarks"].size(), 6U);
  EXPECT_EQ(json["room"]["cells"].size(), result.analysis.room->cells.size());
  EXPECT_NEAR(json["floor_from_m"].get<double>(), *result.analysis.reach.floor_from_m, 1e-12);
  const std::string text = table(result);
  EXPECT_THAT(text, HasSubstr(fmt::format("and the floor from {:.2f} m on", *result.analysis.reach.floor_from_m)));
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    EXPECT_LE(end - begin, 120U) << text.substr(begin, end - begin);
    begin = end + 1;
  }
  EXPECT_THAT(page(result), HasSubstr("\"page\":\"design\""));
}

}  // namespace
}  // namespace twocone::design
