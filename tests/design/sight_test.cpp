// SPDX-License-Identifier: Apache-2.0
#include "apps/design/sight.h"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "vision/triangulation.h"

namespace twocone::design {
namespace {

using vision::MirrorView;
using vision::Side;

std::filesystem::path robots() { return std::filesystem::path(TWOCONE_SOURCE_DIR) / "robots"; }

vision::Rig rig(double apex_rad, double radius_m, double tip_m, double separation_m) {
  const auto view = [&](double lens_m) {
    return MirrorView({.cone = {apex_rad, radius_m, tip_m},
                       .lens_height_m = lens_m,
                       .centre_px = {321.3, 238.6},
                       .rim_radius_px = 231.7});
  };
  return {view(0.23), view(0.23 + separation_m)};
}
vision::Rig floor_rig() { return rig(1.93, 0.071, 0.083, 0.257); }

TEST(Sight, RangesAsTheFormulaOfTheDisparitySays) {
  // For 90 degrees, D = v s / (range + d), so that sigma_range = (range + d)^2 sigma_D / (v s) at every height.
  const double tip_m = 0.117;
  const vision::Rig upright = rig(std::numbers::pi / 2, 0.06, tip_m, 0.31);
  const Sight sight(upright);
  const double v = upright.lower.focal_length_px();
  for (const double distance_m : {1.3, 2.7, 4.9}) {
    const auto shared = sight.shared_heights(distance_m);
    ASSERT_TRUE(shared);
    for (const double share : {0.1, 0.5, 0.9}) {
      const auto sigma_m = sight.range_sigma_m(distance_m, std::lerp(shared->lowest_m, shared->highest_m, share), 0.2);
      ASSERT_TRUE(sigma_m);
      const double expected_m = (distance_m + tip_m) * (distance_m + tip_m) * 0.2 / (v * 0.31);
      EXPECT_NEAR(*sigma_m / expected_m, 1, 1e-9) << distance_m << " m";
    }
  }
}

TEST(Sight, SigmaIsTheScatterOfTriangulatedNoise) {
  const vision::Rig floor = floor_rig();
  const Sight sight(floor);
  std::mt19937_64 random(5);
  constexpr double kSigma_px = 0.05;
  std::normal_distribution<double> noise(0, kSigma_px / std::numbers::sqrt2);
  constexpr int kDraws = 3000;
  for (const double distance_m : {0.9, 2.2}) {
    const auto shared = sight.shared_heights(distance_m);
    ASSERT_TRUE(shared);
    const double height_m = (shared->lowest_m + shared->highest_m) / 2;
    const Eigen::Vector3d point_m(distance_m, 0, height_m);
    double squares = 0;
    // A thin landmark's near point is its axis.
    constexpr double kThin_m = 1e-6;
    for (int k = 0; k < kDraws; ++k) {
      vision::Sighting lower;
      vision::Sighting upper;
      lower.pixel_px = floor.lower.project(point_m).value() + Eigen::Vector2d(noise(random), noise(random));
      upper.pixel_px = floor.upper.project(point_m).value() + Eigen::Vector2d(noise(random), noise(random));
      lower.covariance_px2 = upper.covariance_px2 = Eigen::Matrix2d::Identity() * kSigma_px * kSigma_px / 2;
      const auto answer = triangulate(floor, &lower, &upper, kThin_m, std::nullopt);
      ASSERT_TRUE(answer.range_m);
      squares += (*answer.range_m - distance_m) * (*answer.range_m - distance_m);
    }
    // The scatter of 3000 draws is known to 1.3 %.
    EXPECT_NEAR(std::sqrt(squares / kDraws) / *sight.range_sigma_m(distance_m, height_m, kSigma_px), 1, 0.05);
  }
}

TEST(Sight, AWrongNumberMovesTheRangeAsTriangulationDoes) {
  const vision::Rig truth = floor_rig();
  const Eigen::Vector3d point_m(2.3, 0, 0.11);
  const auto per_number = Sight(truth).range_per_number(point_m.x(), point_m.z());
  ASSERT_TRUE(per_number);
  for (const auto& [number, error] : {std::pair<int, double>{vision::rig_number(Side::kLower, vision::kRim), 0.3},
                                      {vision::rig_number(Side::kUpper, vision::kApex), 5e-4},
                                      {vision::rig_number(Side::kUpper, vision::kTiltY), -5e-4},
                                      {vision::rig_number(Side::kLower, vision::kLensToTip), 2e-4},
                                      {vision::kSeparation, 1e-3}}) {
    Eigen::VectorXd errors = Eigen::VectorXd::Zero(vision::kRigNumbers);
    errors[number] = error;
    vision::Sighting lower;
    vision::Sighting upper;
    lower.pixel_px = truth.lower.project(point_m).value();
    upper.pixel_px = truth.upper.project(point_m).value();
    const auto answer = triangulate(with_errors(truth, errors), &lower, &upper, 1e-6, std::nullopt);
    ASSERT_TRUE(answer.range_m);
    const double expected_m = (*per_number)[number] * error;
    // The range is not quite linear in the number.
    EXPECT_NEAR(*answer.range_m - point_m.x(), expected_m, 0.05 * std::abs(expected_m) + 1e-6)
        << vision::rig_number_name(number);
  }
}

TEST(Sight, HeightsEndWhereAViewEnds) {
  const Sight sight(floor_rig());
  const auto both = [&](double distance_m, double height_m) {
    return sight.shows(Side::kLower, distance_m, height_m) && sight.shows(Side::kUpper, distance_m, height_m);
  };
  for (const double distance_m : {0.7, 1.1, 3.9}) {
    const auto shared = sight.shared_heights(distance_m);
    ASSERT_TRUE(shared) << distance_m;
    constexpr double kMillimetre_m = 0.001;
    EXPECT_TRUE(both(distance_m, shared->highest_m));
    EXPECT_FALSE(both(distance_m, shared->highest_m + kMillimetre_m));
    EXPECT_TRUE(both(distance_m, shared->lowest_m));
    if (shared->lowest_m > 0) {
      EXPECT_FALSE(both(distance_m, shared->lowest_m - kMillimetre_m));
    }
  }
  const auto floor_m = sight.floor_from_m();
  ASSERT_TRUE(floor_m);
  EXPECT_TRUE(both(*floor_m, 0));
  EXPECT_FALSE(both(*floor_m - 0.001, 0));
  EXPECT_FALSE(Sight(rig(std::numbers::pi / 2, 0.06, 0.12, 0.3)).floor_from_m()) << "a 90 degree pair sees no floor";
}

TEST(Analysis, OfTheLabSaysWhatItIsKnownFor) {
  const config::Robot robot = config::read_robot(robots() / "lab_sim.yaml");
  const Analysis lab = analyse(robot, config::read_map(robot.map), {.room_step_m = 0.5});
  // A pair of 90 degrees sees nothing below the upper tip, here 0.67 m, in both mirrors.
  ASSERT_TRUE(lab.reach.least_height_m);
  EXPECT_NEAR(*lab.reach.least_height_m, 0.67, 0.05);
  EXPECT_FALSE(lab.reach.floor_from_m);
  ASSERT_TRUE(lab.room);
  ASSERT_GT(lab.room->cells.size(), 30U);
  for (const RoomCell& cell : lab.room->cells) {
    EXPECT_LT(cell.sigma_m.value_or(0), 0.01) << cell.x_m << ", " << cell.y_m;
  }
  EXPECT_FALSE(lab.sensitivities.empty()) << "an exact robot is judged by the errors of a ruler";
  EXPECT_TRUE(std::ranges::is_sorted(lab.sensitivities, std::greater{}, &Sensitivity::range_m));
  ASSERT_FALSE(lab.lines.empty());
  const Sight sight(config::to_rig(robot));
  for (const SigmaLine& line : lab.lines) {
    for (const Eigen::Vector2d& point : line.points_m) {
      EXPECT_NEAR(sight.range_sigma_m(point.x(), point.y(), 0.15).value_or(0) / line.sigma_m, 1, 0.05);
    }
  }
}

TEST(Analysis, RefusesSettingsOutsideTheirDomain) {
  const config::Robot robot = config::read_robot(robots() / "lab_sim.yaml");
  EXPECT_THROW((void)analyse(robot, {}, {.sigma_px = 0}), std::invalid_argument);
  EXPECT_THROW((void)analyse(robot, {}, {.at_m = NAN}), std::invalid_argument);
  EXPECT_THROW((void)analyse(robot, {}, {.room_step_m = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::design
