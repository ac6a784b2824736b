// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/as_built/as_built.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "drivers/sim_povray/scene_geometry.h"
#include "tests/as_built/plans.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"
#include "vision/bands/band_code.h"

namespace twocone::as_built {
namespace {

using sim_povray::SceneGeometry;
using sim_povray::Vec3;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

/// POV-Ray units are 5 cm; the text has all digits.
constexpr double kRounding_m = 1e-9;

class AsBuiltFiles : public testing::Test {
 protected:
  [[nodiscard]] Files written(const AsBuilt& drawn, const std::string& name = "robot") const {
    return write(drawn, folder.path() / name);
  }
  static SceneGeometry geometry_of(const Files& files) {
    const config::Map map = config::read_map(files.built_map);
    return SceneGeometry::read({.scene = *map.scene, .scene_paths = map.scene_paths, .unit_m = map.unit_m}).value();
  }

  testing_support::TemporaryFolder folder;
};

config::Rig rig_of(const std::filesystem::path& file) { return config::read_robot(file).rig; }

/// Returns the landmarks without what a map file does not hold.
std::vector<Landmark> landmarks_of(const std::filesystem::path& file) { return config::read_map(file).landmarks; }

TEST_F(AsBuiltFiles, AreReadBackAsDrawn) {
  for (const char* const room : kRooms) {
    SCOPED_TRACE(room);
    const AsBuilt drawn = Plan(room).drawn(5, {}, Unmodelled{});
    const Files files = written(drawn, room);
    EXPECT_EQ(rig_of(files.built), drawn.built.rig);
    EXPECT_EQ(rig_of(files.believed), drawn.believed.rig);
    EXPECT_EQ(landmarks_of(files.built_map), drawn.built_map.landmarks);
    EXPECT_EQ(landmarks_of(files.believed_map), drawn.believed_map.landmarks);
    const config::Robot built = config::read_robot(files.built), believed = config::read_robot(files.believed);
    EXPECT_EQ(built.drive, drawn.built.drive);
    EXPECT_EQ(believed.drive, drawn.believed.drive);
    EXPECT_EQ(built.map, files.built_map);
    EXPECT_EQ(believed.map, files.believed_map);
    // The simulated worlds are the same but for what the believed map has for obstacles.
    const config::Map built_map = config::read_map(built.map), believed_map = config::read_map(believed.map);
    EXPECT_EQ(built_map.scene, files.scene);
    EXPECT_EQ(believed_map.scene, files.scene);
    EXPECT_EQ(built_map.scene_paths, believed_map.scene_paths);
    EXPECT_EQ(built_map.obstacles, believed_map.obstacles);
    EXPECT_EQ(built.effects, believed.effects);
    EXPECT_EQ(built.lower, believed.lower);
    EXPECT_EQ(built.upper, believed.upper);
    EXPECT_EQ(built.lower.effects, drawn.built.lower.effects);
    EXPECT_EQ(built.start, believed.start);
    EXPECT_NO_THROW(static_cast<void>(config::to_robot_settings(built, built_map, 1)));
    EXPECT_NO_THROW(static_cast<void>(config::to_robot_settings(believed, believed_map, 1)));
  }
}

TEST_F(AsBuiltFiles, HaveBandsWhereThePlanHas) {
  const AsBuilt drawn = Plan("furnished").drawn(2);
  const Files files = written(drawn);
  EXPECT_EQ(landmarks_of(files.believed_map), drawn.believed_map.landmarks);
  const SceneGeometry geometry = geometry_of(files);
  for (const Landmark& landmark : landmarks_of(files.built_map)) {
    const vision::BandCells cells = vision::band_cells(landmark.bands.value().number);
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const double over_line_m = (double(vision::kCellsOverLine) - double(k) - 0.5) * landmark.bands->cell_m;
      const auto seen = geometry.cast({landmark.x_m, landmark.y_m, landmark.top_m + over_line_m}, {1, 0, 0});
      ASSERT_TRUE(seen) << landmark.name;
      EXPECT_NEAR(seen->distance_m, landmark.radius_m, 1e-6) << landmark.name;
      EXPECT_EQ(seen->colour[1] > 0.4, cells[k]) << landmark.name << ", cell " << k;
    }
  }
}

TEST_F(AsBuiltFiles, StateSigmasOfTheBeliefAndNoneOfTheTruth) {
  const Files files = written(Plan("workshop").drawn(3));
  EXPECT_EQ(rig_of(files.built).sigma, config::RigSigma{});
  EXPECT_EQ(config::read_robot(files.built).drive.sigma, config::WheelSigma{});
  for (const Landmark& landmark : landmarks_of(files.built_map)) EXPECT_EQ(landmark.sigma, LandmarkSigma{});
  const config::RigSigma sigma = rig_of(files.believed).sigma.value();
  EXPECT_NEAR(sigma.azimuth_rad, std::numbers::pi / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(sigma.centre_px, 20 / std::sqrt(3.0), 1e-12);
  EXPECT_EQ(rig_of(files.believed).lower.azimuth_rad, 0);
  EXPECT_TRUE(rig_of(files.believed).lower.mirrored) << "the builder knows that";
  for (const Landmark& landmark : landmarks_of(files.believed_map)) {
    EXPECT_NEAR(landmark.sigma.x_m, 0.01 / std::sqrt(3.0), 1e-15);
    EXPECT_NEAR(landmark.sigma.radius_m, 0.001 / std::sqrt(3.0), 1e-15);
  }
}

TEST_F(AsBuiltFiles, HaveTheSameBytesForTheSameSeedInAnyFolder) {
  const Plan plan("lab");
  const auto all_of = [](const Files& files) {
    std::string text;
    for (const auto& file : {files.scene, files.built_map, files.built, files.believed_map, files.believed}) {
      text += config::read_text(file);
    }
    return text;
  };
  const std::string first = all_of(written(plan.drawn(21, {}, Unmodelled{}), "a"));
  EXPECT_EQ(all_of(written(plan.drawn(21, {}, Unmodelled{}), "deeper/b")), first);
  EXPECT_NE(all_of(written(plan.drawn(22, {}, Unmodelled{}), "c")), first);
}

TEST_F(AsBuiltFiles, ShowTheLandmarksWhereTheTruthHasThem) {
  for (const char* const room : kRooms) {
    const AsBuilt drawn = Plan(room).drawn(9);
    const auto cylinders = geometry_of(written(drawn, room)).upright_cylinders();
    for (const Landmark& landmark : drawn.built_map.landmarks) {
      const auto is_it = [&](const sim_povray::SceneCylinder& c) {
        return std::hypot(c.x_m - landmark.x_m, c.y_m - landmark.y_m) < kRounding_m &&
               std::abs(c.radius_m - landmark.radius_m) < kRounding_m &&
               std::abs(c.top_m - landmark.top_m) < kRounding_m && std::abs(c.bottom_m) < kRounding_m &&
               c.colour == landmark.colour;
      };
      EXPECT_EQ(std::ranges::count_if(cylinders, is_it), 1) << room << ", " << landmark.name;
    }
  }
}

/// Returns the two places where a level line through a landmark meets its surface, as distances from `middle`.
std::pair<double, double> cut(const SceneGeometry& geometry, const Vec3& middle, double direction_rad, double reach_m) {
  const double x = std::cos(direction_rad), y = std::sin(direction_rad);
  const auto from = [&](double sign) {
    const Vec3 origin{middle.x + sign * reach_m * x, middle.y + sign * reach_m * y, middle.z};
    return reach_m - geometry.cast(origin, {-sign * x, -sign * y, 0}).value().distance_m;
  };
  return {from(1), from(-1)};
}

TEST_F(AsBuiltFiles, ShowLandmarksThatLeanOrAreOval) {
  const Plan plan("hall");
  const AsBuilt drawn = plan.drawn(2, {}, Unmodelled{});
  const SceneGeometry geometry = geometry_of(written(drawn));
  int leaning = 0, oval = 0;
  for (std::size_t i = 0; i < drawn.landmarks.size(); ++i) {
    const Landmark& landmark = drawn.built_map.landmarks[i];
    const LandmarkFlaws& flaws = drawn.landmarks[i];
    SCOPED_TRACE(landmark.name);
    constexpr double kBelow_m = 0.4;  // the top; nothing else is so near there
    const Vec3 middle{landmark.x_m, landmark.y_m, landmark.top_m - kBelow_m};
    const double reach_m = landmark.radius_m + 0.05;
    const auto [ahead, behind] = cut(geometry, middle, flaws.direction_rad, reach_m);
    const auto [left, right] = cut(geometry, middle, flaws.direction_rad + std::numbers::pi / 2, reach_m);
    if (flaws.oval > 0) {
      ++oval;
      EXPECT_NEAR(ahead, landmark.radius_m * 1.01, kRounding_m);
      EXPECT_NEAR(behind, landmark.radius_m * 1.01, kRounding_m);
      EXPECT_NEAR(left, landmark.radius_m * 0.99, kRounding_m);
      EXPECT_NEAR(right, landmark.radius_m * 0.99, kRounding_m);
    } else {
      ++leaning;
      // The axis is behind by 0.4 m tan(0.5 degrees) there, and a level cut is longer by 1 / cos(0.5 degrees).
      const double shift_m = kBelow_m * std::tan(flaws.lean_rad);
      EXPECT_NEAR(ahead, landmark.radius_m / std::cos(flaws.lean_rad) - shift_m, kRounding_m);
      EXPECT_NEAR(behind, landmark.radius_m / std::cos(flaws.lean_rad) + shift_m, kRounding_m);
    }
  }
  EXPECT_GT(leaning, 0);
  EXPECT_GT(oval, 0);
}

TEST_F(AsBuiltFiles, HaveAMirrorThatBulgesAtHalfItsHeightAndEndsAtTheConesTipAndRim) {
  for (const char* const room : kRooms) {
    SCOPED_TRACE(room);
    const AsBuilt drawn = Plan(room).drawn(4, {}, Unmodelled{});
    const std::string text = config::read_text(written(drawn, room).scene);
    const std::regex pattern(R"(quadric \{ <1, ([^,]*), 1>, <0, 0, 0>, <0, ([^,]*), 0>, 0 \})");
    std::smatch found;
    ASSERT_TRUE(std::regex_search(text, found, pattern));
    const double yy = std::stod(found[1]), y = std::stod(found[2]);
    // x^2 + z^2 = -yy h^2 - y h at the height h over the tip.
    const auto radius_m = [&](double height_m) { return std::sqrt(-yy * height_m * height_m - y * height_m); };
    const config::RigView& view = drawn.lower.bulge_m > 0 ? drawn.built.rig.lower : drawn.built.rig.upper;
    const double half_rad = view.apex_rad / 2, height_m = view.mirror_radius_m / std::tan(half_rad);
    EXPECT_EQ(radius_m(0), 0);
    EXPECT_NEAR(radius_m(height_m), view.mirror_radius_m, 1e-12);
    EXPECT_NEAR((radius_m(height_m / 2) - view.mirror_radius_m / 2) * std::cos(half_rad), 0.0001, 1e-12);
    // At the height of its middle the surface is outside the cone everywhere.
    for (double part = 0.05; part < 1; part += 0.05) {
      EXPECT_GT(radius_m(part * height_m), part * view.mirror_radius_m) << part;
    }
  }
}

TEST_F(AsBuiltFiles, AreRefusedWhereTheScenesLandmarksOrRobotStay) {
  const Plan plan("lab");
  const auto with_scene = [&](const std::string& text) {
    Plan other = plan;
    other.map.scene = folder.write("other.pov", text);
    return testing_support::error_of<BadPlan>([&] { static_cast<void>(written(other.drawn(1), "none")); });
  };
  std::string scene = config::read_text(*plan.map.scene);
  const std::string guard = "#ifndef (Landmarks_Elsewhere)";
  ASSERT_NE(scene.find(guard), std::string::npos);
  std::string fixed = scene;
  fixed.replace(fixed.find(guard), guard.size(), "#if (1)");
  EXPECT_THAT(with_scene(fixed), AllOf(StartsWith((folder.path() / "other.pov:163: landmark ").string()),
                                       HasSubstr("must stand between `#ifndef (Landmarks_Elsewhere)`")));
  EXPECT_THAT(with_scene("#version 3.7;\nsphere { 0, 1 }\n"), HasSubstr("there is no robot"));
  Plan without = plan;
  without.map.scene.reset();
  EXPECT_THAT(testing_support::error_of<BadPlan>([&] { static_cast<void>(written(without.drawn(1), "none")); }),
              HasSubstr("scene is missing"));
}

}  // namespace
}  // namespace twocone::as_built
