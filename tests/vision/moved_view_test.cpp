// SPDX-License-Identifier: Apache-2.0
// Tests of MirrorView with a tilted unit, off the axis, behind a lens.
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "tests/support/error_of.h"
#include "tests/vision/lab_rig.h"
#include "vision/mirror_view.h"

namespace twocone::vision {
namespace {

using twocone::testing_support::error_of;

// Pixels near 600 are rounded to 1e-13. Lens, rotation and mirror add some fifty roundings, and the lens's inverse may
// amplify them a few times.
constexpr double kPixelRounding_px = 1e-11;

/// A view in which no parameter is zero and no two are equal. @param terms number of terms of the lens model, 0: no
/// lens
MirrorViewSettings odd_view(std::mt19937_64& random, int terms) {
  std::uniform_real_distribution<double> symmetric(-1, 1);
  MirrorViewSettings s{.cone = {.apex_rad = std::numbers::pi / 2 + 0.6 * symmetric(random),
                                .rim_radius_m = 0.053,
                                .lens_to_tip_m = 0.117},
                       .lens_height_m = 0.31,
                       .centre_px = {301.7, 251.3},
                       .rim_radius_px = 219.6,
                       .azimuth_rad = 3 * symmetric(random),
                       .mirrored = symmetric(random) > 0};
  s.tilt_rad = 0.3 * Eigen::Vector2d(symmetric(random), symmetric(random));
  s.axis_offset_m = 0.02 * Eigen::Vector2d(symmetric(random), symmetric(random));
  const std::vector<double> coefficients = {-0.21, 0.07, 0.0013, -0.0021, -0.013, 0.052, -0.08, 0.023};
  if (terms > 0) {
    s.distortion = {{coefficients.begin(), coefficients.begin() + terms}, {701.3, 698.9}, {322.7, 243.1}};
  }
  return s;
}

/// The ray that the pixel sees, traced step by step through a tilted cone in the body's frame: the lens's ray, its
/// intersection with the quadric ((X - T).a)^2 = cos^2(half) |X - T|^2, the quadric's gradient there, r = i - 2 (i.n)
/// n. It shares no formula with MirrorView except the definitions of azimuth and tilt.
Ray trace(const MirrorViewSettings& s, double focal_px, const Eigen::Vector2d& undistorted_px) {
  // It computes in long double, since some three digits cancel in the quadratic near the tip.
  using Real = long double;
  using Vector = Eigen::Matrix<Real, 3, 1>;
  using Matrix = Eigen::Matrix<Real, 3, 3>;
  const Real cx = std::cos(Real(s.tilt_rad.x()));
  const Real sx = std::sin(Real(s.tilt_rad.x()));
  const Real cy = std::cos(Real(s.tilt_rad.y()));
  const Real sy = std::sin(Real(s.tilt_rad.y()));
  Matrix about_x;
  about_x << 1, 0, 0, 0, cx, -sx, 0, sx, cx;
  Matrix about_y;
  about_y << cy, 0, sy, 0, 1, 0, -sy, 0, cy;
  const Matrix turn = about_y * about_x;
  const Vector lens(s.axis_offset_m.x(), s.axis_offset_m.y(), s.lens_height_m);
  const Vector axis = turn.col(2);
  const Vector tip = lens + s.cone.lens_to_tip_m * axis;

  const Real x = (Real(undistorted_px.x()) - s.centre_px.x()) / focal_px;
  const Real y = (Real(undistorted_px.y()) - s.centre_px.y()) / focal_px * (s.mirrored ? -1 : 1);
  const Real ca = std::cos(Real(s.azimuth_rad));
  const Real sa = std::sin(Real(s.azimuth_rad));
  const Vector incoming = (turn * Vector(ca * x - sa * y, sa * x + ca * y, 1)).normalized();

  const Real cc = std::pow(std::cos(Real(s.cone.apex_rad) / 2), 2);
  const Vector from_tip = lens - tip;
  const Real a = std::pow(incoming.dot(axis), 2) - cc;
  const Real b = 2 * (incoming.dot(axis) * from_tip.dot(axis) - cc * incoming.dot(from_tip));
  const Real c = std::pow(from_tip.dot(axis), 2) - cc * from_tip.squaredNorm();
  const Real root = std::sqrt(b * b - 4 * a * c);
  Real along = std::numeric_limits<Real>::infinity();
  for (const Real t : {(-b - root) / (2 * a), (-b + root) / (2 * a)}) {
    const bool is_on_the_cone = (lens + t * incoming - tip).dot(axis) > 0;  // not on its image through the tip
    if (t > 0 && is_on_the_cone) along = std::min(along, t);
  }
  const Vector hit = lens + along * incoming;
  const Vector normal = ((hit - tip).dot(axis) * axis - cc * (hit - tip)).normalized();
  return {hit.cast<double>(), (incoming - 2 * incoming.dot(normal) * normal).cast<double>()};
}

TEST(MovedView, EveryRayObeysTheLawOfReflectionAtATurnedCone) {
  // A few roundings of values near 1, and a pixel's rounding, 3e-14 of 300 px, over a focal length of some 600 px.
  constexpr double kTolerance = 1e-14;
  std::mt19937_64 random(20071);
  std::uniform_real_distribution<double> fraction(0.05, 0.99);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  for (int i = 0; i < 3000; ++i) {
    const MirrorViewSettings s = odd_view(random, 0);
    const MirrorView view(s);
    const double angle = turn(random);
    const double radius_px = fraction(random) * s.rim_radius_px;
    const Eigen::Vector2d pixel = s.centre_px + radius_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Ray expected = trace(s, view.focal_length_px(), pixel);
    const auto ray = view.back_project(pixel);
    ASSERT_TRUE(ray) << "case " << i;
    EXPECT_LT((ray->origin_m - expected.origin_m).norm(), kTolerance) << "case " << i;
    EXPECT_LT((ray->direction - expected.direction).norm(), kTolerance) << "case " << i;
  }
}

TEST(MovedView, ATiltAboutXLeansTheAxisTowardsMinusY) {
  // R_y(b) R_x(a) z = (sin b cos a, -sin a, cos b cos a).
  MirrorViewSettings s = lab_view(0.25);
  s.tilt_rad = {0.031, -0.017};
  s.axis_offset_m = {0.003, -0.005};
  const MirrorView view(s);
  const Eigen::Vector3d expected(0.003 + 0.12 * std::sin(-0.017) * std::cos(0.031), -0.005 - 0.12 * std::sin(0.031),
                                 0.25 + 0.12 * std::cos(-0.017) * std::cos(0.031));
  EXPECT_LT((view.tip_m() - expected).norm(), 4 * std::numeric_limits<double>::epsilon());
  EXPECT_EQ(view.lens_m(), Eigen::Vector3d(0.003, -0.005, 0.25));
}

TEST(MovedView, ForwardAndInverseMeetThroughTurnOffsetAndLens) {
  std::mt19937_64 random(20072);
  std::uniform_real_distribution<double> fraction(0.02, 0.999);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  std::uniform_real_distribution<double> along(0.2, 9);
  const int terms[] = {0, 4, 5, 8};
  for (int i = 0; i < 20000; ++i) {
    const MirrorViewSettings s = odd_view(random, terms[i % 4]);
    const MirrorView view(s);
    const double angle = turn(random);
    const double radius_px = fraction(random) * s.rim_radius_px;
    const auto pixel = view.distort_px(s.centre_px + radius_px * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    ASSERT_TRUE(pixel) << "case " << i;
    const auto ray = view.back_project(*pixel);
    ASSERT_TRUE(ray) << "case " << i;
    const Eigen::Vector3d p = ray->origin_m + along(random) * ray->direction;
    const auto again = view.project(p);
    ASSERT_TRUE(again) << "case " << i;
    EXPECT_LT((*again - *pixel).norm(), kPixelRounding_px) << "case " << i << ", " << radius_px << " px from the tip";

    // The ray of that pixel passes through the point too: a pixel's rounding turns it by that rounding over the radius.
    const auto second = view.back_project(*again);
    ASSERT_TRUE(second) << "case " << i;
    const Eigen::Vector3d from_origin = p - second->origin_m;
    const double off_m = (from_origin - from_origin.dot(second->direction) * second->direction).norm();
    EXPECT_LT(off_m, 10 * from_origin.norm() * kPixelRounding_px / radius_px) << "case " << i;
  }
}

TEST(MovedView, TheJacobianIsThatOfTheProjection) {
  // Central differences have errors of step^2 curvature and rounding / step, both near 1e-6 of the largest entry here.
  constexpr double kStep_m = 1e-5;
  constexpr double kTolerance = 2e-6;
  std::mt19937_64 random(20073);
  std::uniform_real_distribution<double> place(-3, 3);
  std::uniform_real_distribution<double> height(0.3, 2.5);
  const int terms[] = {0, 4, 5, 8};
  int seen = 0;
  for (int i = 0; i < 4000; ++i) {
    const MirrorView view(odd_view(random, terms[i % 4]));
    const Eigen::Vector3d p(place(random), place(random), height(random));
    const auto shown = view.project_with_jacobian(p);
    const auto pixel = view.project(p);
    ASSERT_EQ(shown.has_value(), pixel.has_value()) << "case " << i;
    if (!shown || p.head<2>().norm() < 0.5) continue;
    EXPECT_LT((shown->pixel_px - *pixel).norm(), kPixelRounding_px) << "case " << i;
    Eigen::Matrix<double, 2, 3> expected;
    bool is_inside = true;
    for (int k = 0; k < 3; ++k) {
      const auto after = view.project(p + kStep_m * Eigen::Vector3d::Unit(k));
      const auto before = view.project(p - kStep_m * Eigen::Vector3d::Unit(k));
      is_inside &= after && before;
      if (is_inside) expected.col(k) = (*after - *before) / (2 * kStep_m);
    }
    if (!is_inside) continue;
    ++seen;
    EXPECT_LT((shown->jacobian - expected).cwiseAbs().maxCoeff(), kTolerance * expected.cwiseAbs().maxCoeff())
        << "case " << i << ", got\n"
        << shown->jacobian << "\nwanted\n"
        << expected;
  }
  EXPECT_GT(seen, 800);
}

TEST(MovedView, ZerosAndANeutralLensChangeNoBit) {
  MirrorViewSettings s = lab_view(0.25);
  const MirrorView plain(s);
  s.distortion = {{0, 0, 0, 0}, {500, 500}, {320, 240}};
  s.tilt_rad = {0.0, -0.0};
  const MirrorView same(s);
  EXPECT_FALSE(same.has_distortion());
  std::mt19937_64 random(20074);
  std::uniform_real_distribution<double> place(-3, 3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(place(random), place(random), 0.9);
    ASSERT_EQ(plain.project(p), same.project(p));
    if (const auto pixel = plain.project(p)) {
      ASSERT_EQ(plain.back_project(*pixel)->origin_m, same.back_project(*pixel)->origin_m);
      ASSERT_EQ(plain.back_project(*pixel)->direction, same.back_project(*pixel)->direction);
    }
  }
}

TEST(MovedView, GoesOnBeyondTheRimOnlyWhenAsked) {
  const MirrorView view(lab_view(0.25));
  const Eigen::Vector3d near(1.2, 0.3, 0.9);  // the rim shows 0.9 m from 1.47 m on
  EXPECT_FALSE(view.project(near));
  EXPECT_FALSE(view.project_with_jacobian(near));
  const auto beyond = view.project_with_jacobian(near, Rim::kGoesOn);
  ASSERT_TRUE(beyond);
  EXPECT_NEAR((beyond->pixel_px - Eigen::Vector2d(319.5, 239.5)).norm(), 708 * 0.53 / (std::hypot(1.2, 0.3) + 0.12),
              1e-10);
  EXPECT_FALSE(view.back_project(beyond->pixel_px));
  const auto ray = view.back_project(beyond->pixel_px, Rim::kGoesOn);
  ASSERT_TRUE(ray);
  EXPECT_LT((near - ray->origin_m).normalized().cross(ray->direction).norm(), 1e-13);
  EXPECT_FALSE(view.back_project({319.5 + 708, 239.5}, Rim::kGoesOn));  // along the side of the cone
}

TEST(MovedView, NamesEveryBadSetting) {
  MirrorViewSettings s = lab_view(0.25);
  s.tilt_rad = {0.8, std::numeric_limits<double>::quiet_NaN()};
  s.axis_offset_m = {0, std::numeric_limits<double>::infinity()};
  const auto error = [&s] { return error_of<std::invalid_argument>([&s] { MirrorView view(s); }); };
  EXPECT_EQ(
      error(),
      "MirrorView: tilt_rad about x is 0.8, must be within a quarter of pi rad either way; tilt_rad about y is "
      "nan, must be within a quarter of pi rad either way; axis_offset_m y is inf, must be a finite number of m;");
  s = lab_view(0.25);
  s.distortion = {{0.1, 0.2, 0.3}, {0, 500}, {320, 240}};
  EXPECT_EQ(error(),
            "Lens: distortion has 3 coefficients, must have 4, 5 or 8; distortion focal_px x is 0, must be > 0 px;");
}

}  // namespace
}  // namespace twocone::vision
