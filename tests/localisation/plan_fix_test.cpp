// SPDX-License-Identifier: Apache-2.0
#include "localisation/plan_fix.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

namespace twocone::localisation {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Returns a room of 5 m by 4 m with a cupboard and a round table.
FloorPlan room() {
  FloorPlan plan;
  const auto add = [&](const std::vector<Eigen::Vector2d>& corners) {
    for (std::size_t k = 0; k < corners.size(); ++k) {
      plan.edges.push_back({corners[k], corners[(k + 1) % corners.size()]});
    }
  };
  add({{-2.5, -2}, {2.5, -2}, {2.5, 2}, {-2.5, 2}});
  add({{-2.5, 0.5}, {-1.9, 0.5}, {-1.9, 1.6}, {-2.5, 1.6}});
  plan.discs.push_back({{1.2, -0.9}, 0.4});
  return plan;
}

/// Returns the distance from a place to what the plan shows in a direction.
double range_m(const FloorPlan& plan, const Eigen::Vector2d& from_m, const Eigen::Vector2d& along) {
  double nearest_m = 1e3;
  for (const FloorPlan::Edge& edge : plan.edges) {
    Eigen::Matrix2d m;
    m << along, edge.from_m - edge.to_m;
    if (std::abs(m.determinant()) < 1e-12) continue;
    const Eigen::Vector2d way = m.inverse() * (edge.from_m - from_m);
    if (way.x() > 0 && way.y() >= 0 && way.y() <= 1) nearest_m = std::min(nearest_m, way.x());
  }
  for (const Disc& disc : plan.discs) {
    const Eigen::Vector2d to_m = Eigen::Vector2d(disc.centre.x_m, disc.centre.y_m) - from_m;
    const double middle_m = to_m.dot(along);
    const double aside2 = to_m.squaredNorm() - middle_m * middle_m;
    if (middle_m > 0 && aside2 < disc.radius_m * disc.radius_m) {
      nearest_m = std::min(nearest_m, middle_m - std::sqrt(disc.radius_m * disc.radius_m - aside2));
    }
  }
  return nearest_m;
}

/// Returns a scan of a room, with noise of `sigma_m` in the ranges.
std::vector<ScanPoint> scan_of(const FloorPlan& seen, const Pose& at, double sigma_m, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, sigma_m);
  std::vector<ScanPoint> points;
  for (int k = 0; k < 360; ++k) {
    const double beam_rad = (k - 179.5) * kDegree;
    const double course_rad = at.heading_rad + beam_rad;
    const double range = range_m(seen, {at.x_m, at.y_m}, {std::cos(course_rad), std::sin(course_rad)}) + noise(random);
    points.push_back({range * Eigen::Vector2d(std::cos(beam_rad), std::sin(beam_rad)), std::max(sigma_m, 1e-4)});
  }
  return points;
}

TEST(PlanFix, WithoutNoiseIsThePose) {
  const Pose truth{0.3, -0.2, 0.7};
  const auto fix = fix_by_plan(room(), scan_of(room(), truth, 0, 1), {0.38, -0.12, 0.72}, 0.3);
  ASSERT_TRUE(fix);
  EXPECT_NEAR(fix->pose.x_m, truth.x_m, 1e-4);
  EXPECT_NEAR(fix->pose.y_m, truth.y_m, 1e-4);
  EXPECT_NEAR(fix->pose.heading_rad, truth.heading_rad, 1e-4);
  EXPECT_GT(fix->used, 340) << "the others are at corners";
}

TEST(PlanFix, SigmasHoldTheTruthOverSeeds) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> x(-1.2, 0.5);
  std::uniform_real_distribution<double> y(-1.2, 1.2);
  std::uniform_real_distribution<double> heading(-3, 3);
  constexpr int kPoses = 200;
  int position_held = 0;
  int heading_held = 0;
  for (int k = 0; k < kPoses; ++k) {
    const Pose truth{x(random), y(random), heading(random)};
    const auto fix =
        fix_by_plan(room(), scan_of(room(), truth, 0.03, unsigned(k)), truth, 0.2, {.plan_sigma_m = 0.002});
    ASSERT_TRUE(fix);
    const Eigen::Vector2d off_m(fix->pose.x_m - truth.x_m, fix->pose.y_m - truth.y_m);
    EXPECT_LT(off_m.norm(), 0.02);
    position_held += off_m.dot(fix->covariance.topLeftCorner<2, 2>().inverse() * off_m) < 5.991 ? 1 : 0;
    const double off_rad = wrap_angle_rad(fix->pose.heading_rad - truth.heading_rad);
    heading_held += std::abs(off_rad) < 1.96 * std::sqrt(fix->covariance(2, 2)) ? 1 : 0;
  }
  // Of 95 %, by more than three sigmas of counting below; above: they are no more than twice too wide.
  EXPECT_GE(position_held, 0.90 * kPoses);
  EXPECT_GE(heading_held, 0.90 * kPoses);
}

TEST(PlanFix, WhatStandsInTheRoomAndIsNotInThePlanIsLeftOut) {
  FloorPlan seen = room();
  seen.discs.push_back({{-0.6, -0.7}, 0.25});
  seen.edges.push_back({{0.2, 1.0}, {1.0, 1.1}});
  const Pose truth{0.3, -0.2, -2.0};
  const auto fix = fix_by_plan(room(), scan_of(seen, truth, 0.01, 3), {0.25, -0.25, -2.03}, 0.2);
  ASSERT_TRUE(fix);
  EXPECT_LT(std::hypot(fix->pose.x_m - truth.x_m, fix->pose.y_m - truth.y_m), 0.01);
  EXPECT_LT(fix->used, 330);
}

TEST(PlanFix, IsFoundFromAStartKnownToThirtyCentimetresAndTenDegrees) {
  for (unsigned k = 0; k < 12; ++k) {
    const Pose truth{-0.4, 0.3, 0.5 * k};
    const Pose expected{truth.x_m + 0.3 * std::cos(k), truth.y_m + 0.3 * std::sin(k),
                        truth.heading_rad + (k % 2 == 0 ? 10 : -10) * kDegree};
    const auto fix = find_by_plan(room(), scan_of(room(), truth, 0.02, k), expected, 0.3, 10 * kDegree);
    ASSERT_TRUE(fix);
    EXPECT_LT(std::hypot(fix->pose.x_m - truth.x_m, fix->pose.y_m - truth.y_m), 0.02) << k;
  }
}

TEST(PlanFix, ACorridorWithoutEndsGivesNone) {
  const FloorPlan corridor{{{{-20, -1}, {20, -1}}, {{-20, 1}, {20, 1}}}, {}};
  std::vector<ScanPoint> points = scan_of(corridor, {0, 0.2, 0.1}, 0.01, 5);
  std::erase_if(points, [](const ScanPoint& p) { return p.place_m.norm() > 5; });
  EXPECT_FALSE(fix_by_plan(corridor, points, {0, 0.2, 0.1}, 0.2));
}

TEST(PlanFix, TooFewPointsGiveNone) {
  auto points = scan_of(room(), {}, 0.01, 5);
  points.resize(20);
  EXPECT_FALSE(fix_by_plan(room(), points, {}, 0.2));
  EXPECT_FALSE(fix_by_plan(room(), {}, {}, 0.2));
  EXPECT_FALSE(fix_by_plan({}, scan_of(room(), {}, 0.01, 5), {}, 0.2));
}

TEST(PlanFix, WrongArgumentsAreNamed) {
  EXPECT_THROW(fix_by_plan(room(), {}, {}, 0), std::invalid_argument);
  EXPECT_THROW(fix_by_plan(room(), {}, {}, 0.2, {.least_points = 2}), std::invalid_argument);
  EXPECT_THROW(fix_by_plan(room(), {{{1, 0}, 0}}, {}, 0.2), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::localisation
