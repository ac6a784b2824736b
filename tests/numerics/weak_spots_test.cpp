// SPDX-License-Identifier: Apache-2.0
// Tests of formulas for which mutants.sh showed that no other test fixes them.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/special_doubles.h"
#include "vision/mirror_view.h"
#include "vision/paper_ranging.h"

namespace twocone::vision {
namespace {

using twocone::testing_support::kEps;

TEST(WeakSpots, TheRimsPixelIsReflectedAtTheRim) {
  // This fixes v by the apex; forward and inverse projection agree with each other for any v.
  for (const double apex : {0.9, 1.3, 1.8, 2.4}) {
    const MirrorViewSettings s{.cone = {.apex_rad = apex, .rim_radius_m = 0.053, .lens_to_tip_m = 0.117},
                               .lens_height_m = 0.31,
                               .centre_px = {301.5, 251.5},
                               .rim_radius_px = 219.5};
    const auto ray = MirrorView(s).back_project(s.centre_px + Eigen::Vector2d(s.rim_radius_px, 0));
    ASSERT_TRUE(ray) << apex;
    // Lengths below a metre have some ten roundings.
    constexpr double kTolerance_m = 32 * kEps;
    EXPECT_NEAR(ray->origin_m.x(), s.cone.rim_radius_m, kTolerance_m) << apex;
    EXPECT_NEAR(ray->origin_m.z(), s.lens_height_m + s.cone.lens_to_tip_m + s.cone.rim_radius_m / std::tan(apex / 2),
                kTolerance_m)
        << apex;
  }
}

TEST(WeakSpots, TheUpperLineBeginsWhereTheLowerMatchWouldBeInTheUpperImage) {
  // The upper image is half as large again. The landmark is outside of the lower radius there, but inside of the scaled
  // one.
  MirrorViewSettings lower{.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
                           .lens_height_m = 0.25,
                           .centre_px = {200, 200},
                           .rim_radius_px = 120};
  MirrorViewSettings upper = lower;
  upper.lens_height_m = 0.55;
  upper.rim_radius_px = 180;
  constexpr double kRadius_m = 0.1;
  const PaperRanging ranging({MirrorView(lower), MirrorView(upper)},
                             {{.name = "red", .colour = {1, 0, 0}, .radius_m = kRadius_m}}, {401, 401}, {401, 401});
  cv::Mat lower_image(401, 401, CV_8UC3, cv::Scalar(0, 0, 0));
  cv::Mat upper_image = lower_image.clone();
  lower_image.at<cv::Vec3b>(200, 300) = {250, 0, 0};
  upper_image.at<cv::Vec3b>(200, 340) = {250, 0, 0};
  const RangeMeasurement m = ranging.measure(lower_image, upper_image).at(0);
  ASSERT_EQ(m.verdict, RangeVerdict::kOk) << to_string(m.verdict);
  const double disparity_px = 100 - 140 / 1.5;
  EXPECT_NEAR(*m.disparity_px, disparity_px, 64 * kEps * 100);
  // The disparity loses digits by cancellation: 100 px in 6.7.
  const double from_v_m = 3 * 120 * 0.3 / disparity_px;
  EXPECT_NEAR(*m.range_m, from_v_m - 0.12 + kRadius_m, from_v_m * 64 * kEps * 100 / disparity_px);
}

}  // namespace
}  // namespace twocone::vision
