// SPDX-License-Identifier: Apache-2.0
#include "tests/support/hyperboloid_mirror.h"
#include "tests/support/error_of.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "tests/support/special_doubles.h"

namespace twocone::vision {
namespace {

using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

// A dozen roundings of numbers near 1; digits are lost where the surface is nearly parallel to the ray.
constexpr double kRounding = 1e-12;

// The numbers are not round: none is half of another or its square.
constexpr HyperboloidMirrorSettings kOdd{.half_axis_m = 0.0283, .half_focal_m = 0.0517, .rim_radius_m = 0.0791};

/// Reflects the lens's ray of `slope` at the surface y^2 / a^2 - r^2 / b^2 = 1. The point is found by bisection, and
/// the ray is reflected about the gradient. This shares no formula with the class. @returns the point and the direction
std::pair<Eigen::Vector2d, Eigen::Vector2d> reflect(const HyperboloidMirrorSettings& s, double slope) {
  const double a2 = s.half_axis_m * s.half_axis_m;
  const double b2 = s.half_focal_m * s.half_focal_m - a2;
  const auto outside = [&](double z) {
    const double y = z - s.half_focal_m;
    return y * y / a2 - slope * slope * z * z / b2 - 1 < 0;
  };
  double low = s.half_focal_m;  // between the sheets
  double high = 3 * s.half_focal_m;
  for (int i = 0; i < 200; ++i) {
    const double middle = (low + high) / 2;
    (outside(middle) ? low : high) = middle;
  }
  const Eigen::Vector2d point(slope * low, low);
  const Eigen::Vector2d normal = Eigen::Vector2d(-point.x() / b2, (point.y() - s.half_focal_m) / a2).normalized();
  const Eigen::Vector2d incoming = Eigen::Vector2d(slope, 1).normalized();
  return {point, incoming - 2 * incoming.dot(normal) * normal};
}

TEST(HyperboloidMirror, ObeysTheLawOfReflection) {
  const HyperboloidMirror mirror(kOdd);
  for (double slope = 0.013; slope < mirror.rim_slope(); slope += 0.037) {
    const auto [point, direction] = reflect(kOdd, slope);
    const auto elevation = mirror.elevation_rad(slope);
    ASSERT_TRUE(elevation) << slope;
    EXPECT_NEAR(*elevation, std::atan2(direction.y(), direction.x()), kRounding) << "slope " << slope;
    for (const double way_m : {0.0, 0.31, 2.7, 1e6}) {
      const Eigen::Vector2d seen = point + way_m * direction;
      const auto again = mirror.slope(seen.x(), seen.y() - (way_m == 0 ? 1e-9 : 0));  // just before the surface
      ASSERT_TRUE(again) << "slope " << slope << ", " << way_m << " m on";
      EXPECT_NEAR(*again, slope, way_m == 0 ? 1e-7 : kRounding) << way_m << " m on";
    }
  }
}

TEST(HyperboloidMirror, ForwardAndInverseAgree) {
  const HyperboloidMirror mirror(kOdd);
  for (double slope = 0; slope <= mirror.rim_slope(); slope += 0.0173) {
    const double elevation = *mirror.elevation_rad(slope);
    const auto again = mirror.slope(3.3 * std::cos(elevation), mirror.viewpoint_m() + 3.3 * std::sin(elevation));
    ASSERT_TRUE(again) << slope;
    EXPECT_NEAR(*again, slope, kRounding);
  }
}

TEST(HyperboloidMirror, TheMiddleShowsTheLensAndTheRimTheRim) {
  const HyperboloidMirror mirror(kOdd);
  EXPECT_EQ(mirror.slope(0, 0), 0.0);
  EXPECT_NEAR(*mirror.elevation_rad(0), -std::acos(0.0), kRounding);
  const auto [point, direction] = reflect(kOdd, mirror.rim_slope());
  EXPECT_NEAR(point.x(), kOdd.rim_radius_m, kRounding);
}

TEST(HyperboloidMirror, IsCoarsestStraightDown) {
  const HyperboloidMirror mirror(kOdd);
  constexpr double kStep = 1e-6;
  const auto rise = [&](double slope) {
    return (*mirror.elevation_rad(slope + kStep) - *mirror.elevation_rad(slope)) / kStep;
  };
  EXPECT_NEAR(rise(0), (kOdd.half_focal_m + kOdd.half_axis_m) / (kOdd.half_focal_m - kOdd.half_axis_m), 1e-5);
  for (double slope = 0.05; slope < mirror.rim_slope() - kStep; slope += 0.05)
    EXPECT_LT(rise(slope), rise(slope - 0.05));
}

TEST(HyperboloidMirror, ShowsNothingBeyondTheRimOrBehindItself) {
  const HyperboloidMirror mirror(kOdd);
  const double edge = *mirror.elevation_rad(mirror.rim_slope());
  const double height_m = mirror.viewpoint_m() + 2 * std::tan(edge);
  EXPECT_TRUE(mirror.slope(2, height_m - 0.001));
  EXPECT_FALSE(mirror.slope(2, height_m + 0.001));
  EXPECT_FALSE(mirror.slope(0, 5)) << "straight above";
  EXPECT_FALSE(mirror.slope(0.001, mirror.viewpoint_m())) << "inside the mirror";
  EXPECT_FALSE(mirror.slope(0, mirror.viewpoint_m())) << "the viewpoint itself";
  EXPECT_FALSE(mirror.elevation_rad(mirror.rim_slope() + 1e-9));
  EXPECT_FALSE(mirror.elevation_rad(-1e-9));
}

TEST(HyperboloidMirror, HasNoAnswerToWhatIsNotFinite) {
  const HyperboloidMirror mirror(kOdd);
  EXPECT_FALSE(mirror.slope(kNaN, 0));
  EXPECT_FALSE(mirror.slope(kInf, 0));
  EXPECT_FALSE(mirror.slope(1, kNaN));
  EXPECT_FALSE(mirror.slope(1, -kInf));
  EXPECT_FALSE(mirror.slope(-1, 0));
  EXPECT_FALSE(mirror.elevation_rad(kNaN));
}

TEST(HyperboloidMirror, RefusesWhatIsNoHyperboloidNamingAll) {
  EXPECT_EQ(testing_support::error_of<std::invalid_argument>(
                [] { HyperboloidMirror({.half_axis_m = 0.05, .half_focal_m = 0.05, .rim_radius_m = -1}); }),
            "HyperboloidMirror: half_focal_m is 0.05 m, must be > half_axis_m, 0.05 m; rim_radius_m is -1 m, must be "
            "> 0;");
  EXPECT_THROW(HyperboloidMirror({.half_axis_m = kNaN, .half_focal_m = 0.05, .rim_radius_m = 1}),
               std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision
