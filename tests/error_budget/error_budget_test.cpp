// SPDX-License-Identifier: Apache-2.0
#include "apps/error_budget/error_budget.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/lab_robot.h"

namespace twocone::error_budget {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

using testing_support::lab_robot;

config::Map lab_map(double radius_m) {
  config::Map map;
  map.file = "lab.map.yaml";
  map.bounds = {-3.05, 3.05, -2.55, 2.55};
  map.landmarks = {
      {"red", {1, 0, 0}, -2.45, -0.35, radius_m, 0.9},    {"green", {0, 1, 0}, -1.40, 1.95, radius_m, 0.9},
      {"blue", {0, 0, 1}, 1.50, 1.95, radius_m, 0.9},     {"cyan", {0, 1, 1}, 2.45, 0.30, radius_m, 0.9},
      {"magenta", {1, 0, 1}, 1.30, -1.95, radius_m, 0.9}, {"yellow", {1, 1, 0}, -1.50, -1.95, radius_m, 0.9}};
  return map;
}

const ErrorBudgetLine& line_of(const ErrorBudget& budget, const std::string& source) {
  const auto found = std::find_if(budget.lines.begin(), budget.lines.end(),
                                  [&](const ErrorBudgetLine& line) { return line.source == source; });
  if (found == budget.lines.end()) throw std::logic_error("no line " + source);
  return *found;
}

constexpr double kMmPerM = 1000;

// The hard case R8: v wrong by 1 %, r_m by 1 px, a centre by 1 px, at 2.5 m by disparity alone, which is equation 1
// of the paper. Its range is that of the landmark's near edge.
TEST(ErrorBudget, HoldsTheHardCaseR8) {
  ErrorBudgetSettings settings;
  settings.tops_known = false;
  constexpr double radius_m = 0.15;
  settings.range_m = 2.5 + radius_m;
  const ErrorBudget budget = error_budget(lab_robot(), lab_map(radius_m), {}, settings);
  ASSERT_GT(budget.ranges, 0);
  EXPECT_EQ(budget.poses, 0) << "no poses were given";
  EXPECT_EQ(budget.withheld_ranges, 0);
  // range + d = v s / disparity. So the error is relative for v and r_m, and (range + d)^2 / (v s) per pixel.
  constexpr double kWithD_mm = 2620;
  constexpr double kVs_px_mm = 212400;
  // The central differences use 0.01 sigma, so their own error is below 1e-4 of the result. The cone's side has no
  // effect.
  constexpr double kTolerance = 1e-3;
  for (const auto& [source, stated_mm, exact_mm] : {std::tuple{"focal length v, both mirrors", 26, kWithD_mm * 0.01},
                                                    {"rim radius r_m, both mirrors", 11, kWithD_mm / 236},
                                                    {"centre, lower mirror", 32, kWithD_mm * kWithD_mm / kVs_px_mm},
                                                    {"centre, upper mirror", 32, kWithD_mm * kWithD_mm / kVs_px_mm}}) {
    const Contribution range = line_of(budget, source).range;
    EXPECT_NEAR(range.analytic_m * kMmPerM, exact_mm, kTolerance * exact_mm) << source << ", mm";
    EXPECT_EQ(std::lround(range.analytic_m * kMmPerM), stated_mm) << source << ", mm";
  }
}

std::vector<localisation::Pose> some_poses() {
  return {{0.31, -0.42, 0.7}, {-0.83, 0.55, -2.1}, {0.94, 0.61, 2.9}, {-0.12, -0.77, 1.3}};
}

// The Monte Carlo computes answers and the linear propagation only derivatives. For small errors, here a tenth of the
// defaults, they agree within the error of the draws.
TEST(ErrorBudget, PropagationAgreesWithTheDraws) {
  ErrorBudgetSettings settings = settings_for(lab_robot());
  settings.edge_noise_px = 0.05;
  for (double* size :
       {&settings.rim_radius_px, &settings.centre_px, &settings.focal_share, &settings.lens_to_tip_m,
        &settings.separation_m, &settings.tilt_rad, &settings.axis_offset_m, &settings.apex_rad, &settings.azimuth_rad,
        &settings.skew_s, &settings.landmark_place_m, &settings.landmark_top_m, &settings.landmark_radius_m}) {
    *size *= 0.1;
  }
  settings.draws = 200;
  const ErrorBudget budget = error_budget(lab_robot(), lab_map(0.15), some_poses(), settings);
  EXPECT_EQ(budget.poses, 4);
  EXPECT_EQ(budget.withheld_ranges, 0);
  EXPECT_EQ(budget.withheld_positions, 0);
  // A root mean square of n draws has a relative error of 1 / sqrt(2 n) = 5 %. The limit is four times that, for 2
  // times 20 lines.
  constexpr double kTolerance = 0.20;
  // A source without a first-order effect has a second-order one: a mirror turned by 0.01 degree, 2.5 m times its
  // square, and the same again for the spread of the draws.
  constexpr double kSecondOrder_m = 2 * 2.5 * 1.75e-4 * 1.75e-4;
  std::vector<ErrorBudgetLine> lines = budget.lines;
  lines.push_back(budget.total);
  for (const ErrorBudgetLine& line : lines) {
    for (const auto& [what, c] : {std::pair{"range", line.range}, {"position", line.position}}) {
      EXPECT_NEAR(c.monte_carlo_m, c.analytic_m, kTolerance * c.analytic_m + kSecondOrder_m)
          << line.source << ", " << what << ", m";
    }
  }
}

// Checks that there is a line for each source, that each source has an effect, and that it has none where it cannot.
TEST(ErrorBudget, EverySourceMovesThePosition) {
  ErrorBudgetSettings settings = settings_for(lab_robot());
  settings.draws = 4;
  const ErrorBudget budget = error_budget(lab_robot(), lab_map(0.15), some_poses(), settings);
  EXPECT_EQ(budget.lines.size(), 19U);
  double squares_m2 = 0;
  for (const ErrorBudgetLine& line : budget.lines) {
    EXPECT_GT(line.position.analytic_m, 1e-6) << line.source;
    EXPECT_FALSE(line.size.empty()) << line.source;
    squares_m2 += std::pow(line.position.analytic_m, 2);
  }
  EXPECT_NEAR(budget.total.position.analytic_m, std::sqrt(squares_m2), 1e-12);
  EXPECT_EQ(line_of(budget, "landmark's place in the map").range.analytic_m, 0) << "a range does not depend on the map";
  EXPECT_EQ(line_of(budget, "skew between the views").size, "5 ms");
  EXPECT_EQ(line_of(budget, "tilt, lower mirror").size, "0.1 degree");
}

// Six ranges and bearings with equal weights, and all landmarks wrong by 5 mm in x and y. The position error is at most
// one landmark's error and, as a mean, at least that of six.
TEST(ErrorBudget, AMapsErrorIsAveraged) {
  ErrorBudgetSettings settings;
  settings.draws = 1;
  const ErrorBudget budget = error_budget(lab_robot(), lab_map(0.15), some_poses(), settings);
  const double position_m = line_of(budget, "landmark's place in the map").position.analytic_m;
  EXPECT_LT(position_m, std::sqrt(2.0) * 0.005);
  EXPECT_GT(position_m, std::sqrt(2.0) * 0.005 / std::sqrt(6.0));
}

TEST(ErrorBudget, IsTheSameForTheSameSeedOnly) {
  ErrorBudgetSettings settings;
  settings.draws = 3;
  const auto range = [&] { return error_budget(lab_robot(), lab_map(0.15), {}, settings).total.range.monte_carlo_m; };
  const double first_m = range();
  EXPECT_EQ(first_m, range());
  settings.seed = 2;
  EXPECT_NE(first_m, range());
}

TEST(ErrorBudget, AcceptsARoomWithoutLandmarks) {
  config::Map map = lab_map(0.15);
  map.landmarks.clear();
  const ErrorBudget budget = error_budget(lab_robot(), map, some_poses(), {});
  EXPECT_EQ(budget.ranges, 0);
  EXPECT_EQ(budget.poses, 0);
  EXPECT_EQ(budget.total.position.monte_carlo_m, 0);
}

TEST(ErrorBudget, RefusesSettingsByName) {
  ErrorBudgetSettings settings;
  settings.edge_noise_px = 0;
  settings.skew_s = std::nan("");
  settings.draws = 0;
  EXPECT_THAT(
      [&] { (void)error_budget(lab_robot(), lab_map(0.15), {}, settings); },
      ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("edge_noise_px is 0, must be > 0 px"),
                                                 HasSubstr("skew_s is nan"), HasSubstr("draws is 0, must be >= 1"))));
}

TEST(GridPoses, StandWhereTheRobotHasRoom) {
  config::Map map = lab_map(0.15);
  map.obstacles = {Disc{{1.2, -0.8}, 0.2}};
  const auto poses = grid_poses(lab_robot(), map);
  EXPECT_GT(poses.size(), 15U);
  for (const localisation::Pose& pose : poses) {
    EXPECT_LE(std::abs(pose.x_m), 3.05 - 0.2) << "m";
    EXPECT_GE(std::hypot(pose.x_m - 1.2, pose.y_m + 0.8), 0.4 - 1e-12) << "m";
  }
}

}  // namespace
}  // namespace twocone::error_budget
