// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/circle.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace twocone::sim_povray {
namespace {

constexpr double kRounding_px = 1e-9;  // rounding of a few dozen operations on numbers below 1e3

std::vector<Spot> on_circle(const Circle& circle, double from_rad, double to_rad, int count) {
  std::vector<Spot> points;
  for (int i = 0; i < count; ++i) {
    const double a = from_rad + (to_rad - from_rad) * i / count;
    points.push_back({circle.centre.column_px + circle.radius_px * std::cos(a),
                      circle.centre.row_px + circle.radius_px * std::sin(a)});
  }
  return points;
}

constexpr Circle kCircle{{31.7, -12.3}, 44.9};

TEST(EnclosingCircle, OfACircleWithPointsInsideAndInAnyOrder) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> inside(-0.6, 0.6);
  auto points = on_circle(kCircle, 0.1, 0.1 + 2 * M_PI, 37);
  for (int i = 0; i < 50; ++i) {
    points.push_back({kCircle.centre.column_px + kCircle.radius_px * inside(random),
                      kCircle.centre.row_px + kCircle.radius_px * inside(random)});
  }
  for (int i = 0; i < 5; ++i) {
    std::shuffle(points.begin(), points.end(), random);
    const Circle got = enclosing_circle(points);
    EXPECT_NEAR(got.centre.column_px, kCircle.centre.column_px, kRounding_px);
    EXPECT_NEAR(got.centre.row_px, kCircle.centre.row_px, kRounding_px);
    EXPECT_NEAR(got.radius_px, kCircle.radius_px, kRounding_px);
  }
}

TEST(EnclosingCircle, OfOneTwoAndCollinearPoints) {
  EXPECT_EQ(enclosing_circle({{3, 4}}).radius_px, 0);
  EXPECT_NEAR(enclosing_circle({{0, 0}, {3, 4}}).radius_px, 2.5, kRounding_px);
  EXPECT_NEAR(enclosing_circle({{0, 0}, {1, 1}, {6, 6}, {2, 2}}).radius_px, std::hypot(3, 3), kRounding_px);
  EXPECT_NEAR(enclosing_circle({{2, 2}, {2, 2}, {2, 2}}).radius_px, 0, kRounding_px);
}

TEST(FittedCircle, FromAThirdOfItsRim) {
  const Circle got = fitted_circle(on_circle(kCircle, 0.3, 0.3 + 2 * M_PI / 3, 25));
  EXPECT_NEAR(got.centre.column_px, kCircle.centre.column_px, kRounding_px);
  EXPECT_NEAR(got.centre.row_px, kCircle.centre.row_px, kRounding_px);
  EXPECT_NEAR(got.radius_px, kCircle.radius_px, kRounding_px);
}

TEST(ConvexHull, LeavesOutPointsInsideOrOnAnEdge) {
  std::vector<Spot> grid;
  for (int c = 0; c < 5; ++c) {
    for (int r = 0; r < 4; ++r) grid.push_back({double(c), double(r)});
  }
  EXPECT_EQ(convex_hull(grid).size(), 4U);
  EXPECT_EQ(farthest_px(convex_hull(grid), {0, 0}), 5);
}

}  // namespace
}  // namespace twocone::sim_povray
