// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/report/paper.h"
#include "tests/report/synthetic_run.h"

namespace twocone::report {
namespace {

/// Tolerance of the disparity's central difference over 2 mm at 1 m and beyond: its error is h^2 / 6 times the third
/// derivative, relatively (h / (range + d))^2 < 1e-6.
constexpr double kDifferenceTolerance = 1e-5;

// Compares the figure's formula with the mirrors' own projection, which does not use it.
TEST(RigNumbers, RangePerPixelIsTheSlopeOfTheProjection) {
  const config::Robot robot = synthetic_robot();
  const vision::Rig rig = config::to_rig(robot);
  const auto disparity = [&](double range_m) {
    return *rig.lower.image_radius_px(range_m, 0.9) - *rig.upper.image_radius_px(range_m, 0.9);
  };
  for (const double range_m : {1.53, 2.71, 4.37}) {
    const double h = 0.001;
    const double px_per_m = (disparity(range_m - h) - disparity(range_m + h)) / (2 * h);
    const double expected_m = 1 / px_per_m;
    EXPECT_NEAR(range_per_pixel_m(robot.rig, range_m), expected_m, kDifferenceTolerance * expected_m)
        << range_m << " m";
  }
}

TEST(RigNumbers, NearestTopIsWhereTheLowerMirrorBeginsToShowIt) {
  const config::Robot robot = synthetic_robot();
  const vision::Rig rig = config::to_rig(robot);
  for (const double top_m : {0.70, 0.90, 1.13}) {
    const double nearest_m = nearest_top_m(robot.rig, top_m);
    EXPECT_FALSE(rig.lower.image_radius_px(nearest_m - 1e-6, top_m)) << top_m << " m";
    EXPECT_TRUE(rig.lower.image_radius_px(nearest_m + 1e-6, top_m)) << top_m << " m";
  }
  EXPECT_EQ(nearest_top_m(robot.rig, 0.2), 0) << "a top below the lens is never cut off by the rim";
}

TEST(RigNumbers, CommonRegionBeginsWhereTheUpperHorizonMeetsTheLowerRim) {
  const config::Robot robot = synthetic_robot();
  const vision::Rig rig = config::to_rig(robot);
  const double upper_tip_m = 0.25 + 0.12 + 0.30;
  const double nearest_m = nearest_common_m(robot.rig);
  const double h = 1e-6;
  EXPECT_TRUE(rig.lower.image_radius_px(nearest_m + h, upper_tip_m));
  EXPECT_FALSE(rig.lower.image_radius_px(nearest_m - h, upper_tip_m));
  EXPECT_TRUE(rig.upper.image_radius_px(nearest_m, upper_tip_m + h));
  EXPECT_FALSE(rig.upper.image_radius_px(nearest_m, upper_tip_m - h));
}

// Compares the formula with matches that are rounded at many true ranges.
TEST(RigNumbers, RoundingErrorIsThatOfRoundedMatches) {
  const config::Robot robot = synthetic_robot();
  const config::Map map = synthetic_map();
  const config::Landmark& landmark = map.landmarks.front();
  const vision::Rig rig = config::to_rig(robot);
  const double vs = rig.lower.focal_length_px() * rig.mirror_separation_m();
  runlog::RunData run;
  run.robot = robot;
  run.map = map;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<> range(1.6, 4.4);
  constexpr int kSamples = 20000;
  double sum_m = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double true_m = range(random);
    const double edge_m = true_m - landmark.radius_m;
    const double disparity = std::round(*rig.lower.image_radius_px(edge_m, landmark.top_m)) -
                             std::round(*rig.upper.image_radius_px(edge_m, landmark.top_m));
    const double range_m = vs / disparity - robot.rig.lower.lens_to_tip_m + landmark.radius_m;
    sum_m += std::abs(range_m - true_m);
    runlog::RangeRow row{};
    row.landmark = landmark.name;
    row.range_m = range_m;
    row.true_range_m = true_m;
    run.ranges.push_back(row);
  }
  // The two roundings are not quite independent (few whole disparities occur) and the formula is of first order.
  constexpr double kTolerance = 0.05;
  const auto stated_m = rounding_error_m(run, landmark);
  ASSERT_TRUE(stated_m);
  EXPECT_NEAR(*stated_m, sum_m / kSamples, kTolerance * sum_m / kSamples);
}

TEST(RigNumbers, GivesNothingForOtherCones) {
  runlog::RunData run = synthetic_run("unused", 20);
  ASSERT_TRUE(rounding_error_m(run, run.map.landmarks[0]));
  run.robot.rig.upper.apex_rad = 2.0;
  EXPECT_FALSE(rounding_error_m(run, run.map.landmarks[0]));
}

TEST(PaperFigures, AreFoundByNameInAnyCase) {
  ASSERT_NE(paper::find_landmark("Cyan"), nullptr);
  EXPECT_EQ(paper::find_landmark("Cyan")->mean_mm, 62.93);
  EXPECT_EQ(paper::find_landmark("cya"), nullptr);
  EXPECT_EQ(paper::find_landmark("cyan "), nullptr);
}

}  // namespace
}  // namespace twocone::report
