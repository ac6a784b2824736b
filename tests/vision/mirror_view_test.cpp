// SPDX-License-Identifier: Apache-2.0
#include "vision/mirror_view.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/error_of.h"
#include "tests/support/special_doubles.h"
#include "tests/vision/lab_rig.h"

namespace twocone::vision {
namespace {

using twocone::testing_support::error_of;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

// The stated accuracy: forward then inverse projection to 1e-12, relatively.
constexpr double kRoundTrip = 1e-12;

/// A view without round numbers: no angle of 0 or 45 degrees, no equal values.
MirrorViewSettings odd_view(double apex_rad, bool mirrored) {
  return {.cone = {.apex_rad = apex_rad, .rim_radius_m = 0.053, .lens_to_tip_m = 0.117},
          .lens_height_m = 0.31,
          .centre_px = {301.7, 251.3},
          .rim_radius_px = 219.6,
          .azimuth_rad = 0.37,
          .mirrored = mirrored};
}

/// The point where the lens's ray at `slope` meets the cone, and its direction from there, by the law of reflection in
/// three dimensions: r = i - 2 (i.n) n. It shares no formula with MirrorView.
Ray reflect(const MirrorViewSettings& s, double slope, double bearing_rad) {
  const double half = s.cone.apex_rad / 2;
  const Eigen::Vector3d incoming =
      Eigen::Vector3d(slope * std::cos(bearing_rad), slope * std::sin(bearing_rad), 1).normalized();
  // The height z of the point above the lens follows from slope z = (z - d) tan(half).
  const double z = s.cone.lens_to_tip_m * std::sin(half) / (std::sin(half) - slope * std::cos(half));
  const Eigen::Vector3d normal(std::cos(half) * std::cos(bearing_rad), std::cos(half) * std::sin(bearing_rad),
                               -std::sin(half));
  const Eigen::Vector3d outgoing = incoming - 2 * incoming.dot(normal) * normal;
  return {Eigen::Vector3d(slope * z * std::cos(bearing_rad), slope * z * std::sin(bearing_rad), s.lens_height_m + z),
          outgoing};
}

TEST(MirrorView, AgreesWithThePapersFormulasAt90Degrees) {
  const MirrorView view(lab_view(0.25));
  EXPECT_DOUBLE_EQ(view.focal_length_px(), (0.12 / 0.06 + 1) * 236);  // equation 2
  const double rho = 2.317;
  const double height = 0.9;
  EXPECT_NEAR(view.image_radius_px(rho, height).value(), 708 * (height - 0.25 - 0.12) / (rho + 0.12), 1e-12 * 708);
}

TEST(MirrorView, EveryRayObeysTheLawOfReflection) {
  // A ray is computed with a few roundings of values near 1.
  constexpr double kTolerance = 1e-14;
  std::mt19937_64 random(20061);
  std::uniform_real_distribution<double> apex(0.9, 2.4);
  std::uniform_real_distribution<double> fraction(0.01, 0.99);
  std::uniform_real_distribution<double> bearing(-std::numbers::pi, std::numbers::pi);
  for (int i = 0; i < 2000; ++i) {
    const MirrorViewSettings s = odd_view(apex(random), i % 2 == 1);
    const MirrorView view(s);
    const double radius_px = fraction(random) * s.rim_radius_px;
    const double phi = bearing(random);
    const Ray expected = reflect(s, radius_px / view.focal_length_px(), phi);
    const auto ray = view.back_project(s.centre_px + view.offset_px(phi, radius_px));
    ASSERT_TRUE(ray) << "case " << i;
    EXPECT_LT((ray->origin_m - expected.origin_m).norm(), kTolerance) << "case " << i;
    EXPECT_LT((ray->direction - expected.direction).norm(), kTolerance) << "case " << i;
  }
}

TEST(MirrorView, ForwardThenInverseMeetsThePoint) {
  std::mt19937_64 random(20062);
  std::uniform_real_distribution<double> distance(0.4, 8);
  std::uniform_real_distribution<double> height(0.4, 3);
  std::uniform_real_distribution<double> bearing(-std::numbers::pi, std::numbers::pi);
  int seen = 0;
  for (int i = 0; i < 20000; ++i) {
    const MirrorView view(i % 2 == 0 ? lab_view(0.25) : odd_view(std::numbers::pi / 2, true));
    const double phi = bearing(random);
    const double rho = distance(random);
    const Eigen::Vector3d p(rho * std::cos(phi), rho * std::sin(phi), height(random));
    const auto pixel = view.project(p);
    if (!pixel) continue;
    ++seen;
    const auto ray = view.back_project(*pixel);
    ASSERT_TRUE(ray) << "case " << i;
    const Eigen::Vector3d from_origin = p - ray->origin_m;
    const double off_m = (from_origin - from_origin.dot(ray->direction) * ray->direction).norm();
    // A pixel coordinate near 300 is itself rounded to half an ulp, and the ray turns by that over the radius.
    const double radius_px = (*pixel - view.settings().centre_px).norm();
    const double rounding = 512 * std::numeric_limits<double>::epsilon() / radius_px;
    EXPECT_LT(off_m / p.norm(), std::max(kRoundTrip, rounding))
        << "case " << i << ", " << radius_px << " px from the tip";
    EXPECT_GT(from_origin.dot(ray->direction), 0) << "case " << i;
  }
  EXPECT_GT(seen, 5000);
}

TEST(MirrorView, InverseThenForwardMeetsThePixel) {
  std::mt19937_64 random(20063);
  std::uniform_real_distribution<double> apex(0.9, 2.4);
  std::uniform_real_distribution<double> fraction(0.02, 1);
  std::uniform_real_distribution<double> bearing(-std::numbers::pi, std::numbers::pi);
  std::uniform_real_distribution<double> along(0.2, 9);
  for (int i = 0; i < 20000; ++i) {
    const MirrorViewSettings s = odd_view(apex(random), i % 2 == 1);
    const MirrorView view(s);
    const Eigen::Vector2d pixel = s.centre_px + view.offset_px(bearing(random), fraction(random) * s.rim_radius_px);
    const auto ray = view.back_project(pixel);
    ASSERT_TRUE(ray) << "case " << i;
    const auto again = view.project(ray->origin_m + along(random) * ray->direction);
    if (!again) {  // a pixel on the rim may be rounded to outside it
      EXPECT_GT((pixel - s.centre_px).norm(), s.rim_radius_px * (1 - kRoundTrip)) << "case " << i;
      continue;
    }
    EXPECT_LT((*again - pixel).norm() / pixel.norm(), kRoundTrip) << "case " << i;
  }
}

TEST(MirrorView, ShowsNothingAtOrBelowTheHorizonAndBeyondTheRim) {
  const MirrorView view(lab_view(0.25));
  EXPECT_FALSE(view.image_radius_px(2, 0.37));  // the tip's height
  EXPECT_FALSE(view.image_radius_px(2, 0.2));
  EXPECT_TRUE(view.image_radius_px(1.471, 0.9));  // the rim shows a top of 0.9 m from 1.47 m on
  EXPECT_FALSE(view.image_radius_px(1.469, 0.9));
  EXPECT_FALSE(view.project({0, 0, 0.9}));          // on the axis
  EXPECT_FALSE(view.image_radius_px(0.0, 0.4));     // inside the cone
  EXPECT_FALSE(view.back_project({319.5, 239.5}));  // the tip has no bearing
  EXPECT_FALSE(view.back_project({319.5 + 236.01, 239.5}));
}

TEST(MirrorView, AnswersNothingForInputThatIsNotFinite) {
  const MirrorView view(lab_view(0.25));
  for (const double bad : {kNaN, kInf, -kInf}) {
    EXPECT_FALSE(view.image_radius_px(bad, 0.9)) << bad;
    EXPECT_FALSE(view.image_radius_px(2, bad)) << bad;
    EXPECT_FALSE(view.project({bad, 1, 0.9})) << bad;
    EXPECT_FALSE(view.back_project({bad, 1})) << bad;
  }
  EXPECT_FALSE(view.image_radius_px(-1, 0.9));
}

TEST(MirrorView, KeepsDigitsOnHugeAndTinyDistances) {
  const MirrorView view(lab_view(0.25));
  EXPECT_DOUBLE_EQ(view.image_radius_px(1e300, 1e299).value(), 708 * 0.1);
  EXPECT_NEAR(view.image_radius_px(1e8, 0.9).value(), 708 * 0.53 / 1e8, 1e-12);
}

TEST(MirrorView, BearingRunsWithTheImageUnlessMirrored) {
  const MirrorView plain(odd_view(std::numbers::pi / 2, false));
  const MirrorView mirrored(odd_view(std::numbers::pi / 2, true));
  EXPECT_NEAR(plain.bearing_rad({0, 10}), 0.37 + std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(mirrored.bearing_rad({0, 10}), 0.37 - std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(plain.bearing_rad({-10, 0.0}), 0.37 - std::numbers::pi, 1e-15);  // pi + 0.37 wraps
  for (const double bearing : {-3.0, -0.4, 0.0, 1.2, 3.1}) {
    EXPECT_NEAR(plain.bearing_rad(plain.offset_px(bearing, 57)), bearing, 1e-15);
    EXPECT_NEAR(mirrored.bearing_rad(mirrored.offset_px(bearing, 57)), bearing, 1e-15);
  }
}

TEST(MirrorView, NamesEveryBadSetting) {
  MirrorViewSettings s = lab_view(0.25);
  s.cone.apex_rad = 4;
  s.cone.rim_radius_m = 0;
  s.rim_radius_px = kNaN;
  const std::string text = error_of<std::invalid_argument>([&s] { MirrorView view(s); });
  EXPECT_NE(text.find("cone.apex_rad is 4"), std::string::npos) << text;
  EXPECT_NE(text.find("cone.rim_radius_m is 0"), std::string::npos) << text;
  EXPECT_NE(text.find("rim_radius_px is nan"), std::string::npos) << text;
}

const Eigen::Vector2d kFocal_px(701.3, 698.9);
const Eigen::Vector2d kPrincipal_px(322.7, 243.1);
const std::vector<double> kCoefficients[] = {
    {-0.21, 0.07, 0.0013, -0.0021},
    {-0.21, 0.07, 0.0013, -0.0021, -0.013},
    {0.31, -0.12, 0.0013, -0.0021, 0.017, 0.52, -0.08, 0.023},
};

/// The results of cv::projectPoints of OpenCV 4.6 on (x, y, 1), for the models above in order.
struct Reference {
  Eigen::Vector2d at;
  Eigen::Vector2d pixel[3];
};
const Reference kReferences[] = {
    {{0.31, -0.22},
     {{533.20344328735246, 94.202481983435007},
      {533.19491596999342, 94.208512917978254},
      {533.16478881350645, 94.229820311745186}}},
    {{-0.05, 0.47},
     {{288.77831784660196, 557.99347568420364},
      {288.78340022155311, 557.94586485371519},
      {288.79959090899337, 557.79419322723777}}},
    {{0.6, 0.4},
     {{704.10677383999996, 497.48226728000003},
      {703.33762839487986, 496.97125843776001},
      {701.47222304717138, 495.73191075249599}}},
};

TEST(Lens, AgreesWithOpenCvBothWays) {
  // Coordinates below 1024 are 1e-13 apart. There are some ten roundings, in OpenCV's order and in ours.
  constexpr double kRounding_px = 2e-12;
  for (const Reference& reference : kReferences) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Lens lens({kCoefficients[i], kFocal_px, kPrincipal_px});
      const Eigen::Vector2d pinhole = kPrincipal_px + kFocal_px.cwiseProduct(reference.at);
      const auto seen = lens.distort(pinhole);
      ASSERT_TRUE(seen);
      EXPECT_LT((*seen - reference.pixel[i]).norm(), kRounding_px) << reference.at.transpose() << ", model " << i;
      const auto back = lens.undistort(reference.pixel[i]);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - pinhole).norm(), 2 * kRounding_px) << reference.at.transpose() << ", model " << i;
    }
  }
}

TEST(Lens, BothWaysMeet) {
  std::mt19937_64 random(20081);
  std::uniform_real_distribution<double> column(-100, 740);
  std::uniform_real_distribution<double> row(-100, 580);
  for (int i = 0; i < 20000; ++i) {
    const Lens lens({kCoefficients[i % 3], kFocal_px, kPrincipal_px});
    const Eigen::Vector2d pinhole(column(random), row(random));
    const auto seen = lens.distort_with_jacobian(pinhole);
    ASSERT_TRUE(seen) << pinhole.transpose();
    const auto back = lens.undistort(seen->pixel_px);
    ASSERT_TRUE(back) << pinhole.transpose();
    // Roundings of 1e-13, amplified by the inverse of the Jacobian, whose least singular value is above 0.6 here.
    EXPECT_LT((*back - pinhole).norm(), 2e-12) << pinhole.transpose() << ", model " << i % 3;
  }
}

TEST(Lens, TheJacobianIsThatOfTheDistortion) {
  constexpr double kStep_px = 0.01;
  // The error is step^2 times a third derivative of some 1e-6 / px^2, and rounding over the step.
  constexpr double kTolerance = 1e-8;
  const Lens lens({kCoefficients[2], kFocal_px, kPrincipal_px});
  const Eigen::Vector2d at(541.3, 88.7);
  const Eigen::Matrix2d jacobian = lens.distort_with_jacobian(at)->jacobian;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = kStep_px * Eigen::Vector2d::Unit(k);
    const Eigen::Vector2d slope = (*lens.distort(at + step) - *lens.distort(at - step)) / (2 * kStep_px);
    EXPECT_LT((jacobian.col(k) - slope).norm(), kTolerance) << "column " << k;
  }
}

TEST(Lens, BeyondTheFoldThereIsNothing) {
  // x' = x (1 - x^2 / 4) turns back at x = sqrt(4 / 3), where x' is 0.7698: no point is imaged farther out.
  const Lens barrel({{-0.25, 0, 0, 0}, {100, 100}, {0, 0}});
  const double fold_px = 100 * std::sqrt(4.0 / 3);
  EXPECT_TRUE(barrel.distort({0.999 * fold_px, 0}));
  EXPECT_FALSE(barrel.distort({1.001 * fold_px, 0}));
  EXPECT_NEAR(barrel.undistort({76.9, 0})->x(), 112.4165, 1e-4);  // 1.124165 (1 - 1.124165^2 / 4) = 0.769
  EXPECT_FALSE(barrel.undistort({77.1, 0}));
  EXPECT_FALSE(barrel.undistort({500, 0}));
}

TEST(Lens, AnswersNothingForInputThatIsNotFinite) {
  const Lens lens({kCoefficients[0], kFocal_px, kPrincipal_px});
  for (const double bad : {kNaN, kInf}) {
    EXPECT_FALSE(lens.distort({bad, 1})) << bad;
    EXPECT_FALSE(lens.undistort({1, bad})) << bad;
  }
}

}  // namespace
}  // namespace twocone::vision
