// SPDX-License-Identifier: Apache-2.0
// Properties that hold for any input, checked by RapidCheck, which shrinks a failing case to a small one.
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <Eigen/Geometry>

#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"
#include "localisation/paper_trilateration.h"
#include "tests/support/hyperboloid_mirror.h"
#include "tests/support/special_doubles.h"
#include "vision/mirror_view.h"
#include "vision/triangulation.h"

namespace twocone {
namespace {

using twocone::testing_support::kEps;

// The seed is fixed unless the environment sets another, for example RC_PARAMS="seed=1 max_success=100000".
const int kSeeded = setenv("RC_PARAMS", "seed=40650 max_success=1000 max_discard_ratio=20", 0);

/// A number in [low, high] in 2^40 steps; it shrinks towards `low`.
rc::Gen<double> number(double low, double high) {
  constexpr std::int64_t kSteps = std::int64_t{1} << 40;
  return rc::gen::map(rc::gen::inRange<std::int64_t>(0, kSteps + 1),
                      [=](std::int64_t i) { return low + (high - low) * (double(i) / double(kSteps)); });
}
/// A number that is uniform in the logarithm.
rc::Gen<double> scales(double low, double high) {
  return rc::gen::map(number(std::log(low), std::log(high)), [](double x) { return std::exp(x); });
}

template <class Property>
void hold(const char* what, const Property& property) {
  EXPECT_TRUE(rc::check(what, property)) << what;
}

#define RC_NEAR(a, b, tolerance)                                                                          \
  do {                                                                                                    \
    const double rc_off = std::abs((a) - (b));                                                            \
    if (!(rc_off <= (tolerance))) RC_LOG() << #a " - " #b ": " << rc_off << " > " << (tolerance) << "\n"; \
    RC_ASSERT(rc_off <= (tolerance));                                                                     \
  } while (false)

vision::MirrorViewSettings any_view() {
  vision::MirrorViewSettings s;
  s.cone = {*number(0.6, 2.5), *scales(0.01, 1), *scales(0.01, 1)};
  s.lens_height_m = *number(0.05, 2);
  s.centre_px = {*number(0, 1000), *number(0, 1000)};
  s.rim_radius_px = *scales(50, 1000);
  s.azimuth_rad = *number(-std::numbers::pi, std::numbers::pi);
  s.mirrored = *rc::gen::arbitrary<bool>();
  s.tilt_rad = {*number(-0.2, 0.2), *number(-0.2, 0.2)};
  s.axis_offset_m = {*number(-0.05, 0.05), *number(-0.05, 0.05)};
  return s;
}

struct Shown {
  Eigen::Vector2d pixel;
  Eigen::Vector3d point_m;
  double radius_px;
};

/// A pixel inside the rim and a point that it shows.
Shown any_shown(const vision::MirrorView& view) {
  const auto& s = view.settings();
  const double radius_px = *number(0.01, 0.99) * s.rim_radius_px;
  const double turn = *number(-std::numbers::pi, std::numbers::pi);
  const Eigen::Vector2d pixel = s.centre_px + radius_px * Eigen::Vector2d(std::cos(turn), std::sin(turn));
  const auto ray = view.back_project(pixel);
  RC_ASSERT(ray.has_value());
  return {pixel, ray->origin_m + *scales(0.2, 1000) * ray->direction, radius_px};
}

/// The change of a pixel by a few roundings of its coordinates, of the point's angles seen from the mirror, and of the
/// settings: all angles are those of a view whose focal length is v.
double pixel_rounding(const vision::MirrorView& view, const Shown& shown) {
  const auto& s = view.settings();
  const double lengths = shown.point_m.norm() + s.cone.lens_to_tip_m + s.lens_height_m;
  const double distance = (shown.point_m - view.back_project(shown.pixel)->origin_m).norm();
  return 32 * kEps * (s.centre_px.norm() + view.focal_length_px() * (1 + lengths / distance) * std::numbers::pi);
}

TEST(Property, WhatAPixelShowsIsShownByThatPixel) {
  hold("project(back_project(p)) == p", [] {
    const vision::MirrorView view(any_view());
    const Shown shown = any_shown(view);
    const auto again = view.project(shown.point_m);
    RC_ASSERT(again.has_value());
    RC_NEAR((*again - shown.pixel).norm(), 0.0, pixel_rounding(view, shown));
  });
}

TEST(Property, MirroredTwiceIsNotMirrored) {
  hold("a mirrored image of the mirrored world is the image", [] {
    vision::MirrorViewSettings s = any_view();
    s.mirrored = false;
    const vision::MirrorView view(s);
    const Shown shown = any_shown(view);
    vision::MirrorViewSettings m = s;  // the world is mirrored in the x z plane: rotations about x and z change sign
    m.mirrored = true;
    m.azimuth_rad = -s.azimuth_rad;
    m.tilt_rad.x() = -s.tilt_rad.x();
    m.axis_offset_m.y() = -s.axis_offset_m.y();
    const Eigen::Vector3d point(shown.point_m.x(), -shown.point_m.y(), shown.point_m.z());
    const auto pixel = vision::MirrorView(m).project(point);
    const auto plain = view.project(shown.point_m);
    RC_ASSERT(pixel.has_value() && plain.has_value());
    RC_NEAR((*pixel - *plain).norm(), 0.0, pixel_rounding(view, shown));
  });
}

TEST(Property, TheUnitOfLengthDoesNotMatter) {
  hold("everything scaled by a power of two: the same pixel, bit by bit", [] {
    const vision::MirrorViewSettings s = any_view();
    const vision::MirrorView view(s);
    const Shown shown = any_shown(view);
    const double unit = std::ldexp(1.0, *rc::gen::inRange(-60, 60));
    vision::MirrorViewSettings t = s;
    t.cone.rim_radius_m *= unit;
    t.cone.lens_to_tip_m *= unit;
    t.lens_height_m *= unit;
    t.axis_offset_m *= unit;
    const auto plain = view.project(shown.point_m);
    const auto scaled = vision::MirrorView(t).project(shown.point_m * unit);
    RC_ASSERT(plain.has_value() && scaled.has_value());
    RC_ASSERT(*plain == *scaled);
  });
}

TEST(Property, AnUprightViewTurnsWithItsAzimuth) {
  hold("point and azimuth turned alike: the same pixel", [] {
    vision::MirrorViewSettings s = any_view();
    s.tilt_rad.setZero();
    s.axis_offset_m.setZero();
    const vision::MirrorView view(s);
    const Shown shown = any_shown(view);
    const double turn = *number(-std::numbers::pi, std::numbers::pi);
    vision::MirrorViewSettings t = s;
    t.azimuth_rad += turn;
    const auto plain = view.project(shown.point_m);
    const auto turned =
        vision::MirrorView(t).project(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) * shown.point_m);
    RC_ASSERT(plain.has_value() && turned.has_value());
    RC_NEAR((*plain - *turned).norm(), 0.0, pixel_rounding(view, shown));
  });
}

TEST(Property, AViewMovesWithItsAxis) {
  hold("point and axis shifted alike: the same pixel", [] {
    const vision::MirrorViewSettings s = any_view();
    const vision::MirrorView view(s);
    const Shown shown = any_shown(view);
    vision::MirrorViewSettings t = s;
    const Eigen::Vector3d shift(*number(-3, 3), *number(-3, 3), *number(0, 3));
    t.axis_offset_m += shift.head<2>();
    t.lens_height_m += shift.z();
    const auto plain = view.project(shown.point_m);
    const auto moved = vision::MirrorView(t).project(shown.point_m + shift);
    RC_ASSERT(plain.has_value() && moved.has_value());
    const double distance = (shown.point_m - view.back_project(shown.pixel)->origin_m).norm();
    RC_NEAR((*plain - *moved).norm(), 0.0,
            pixel_rounding(view, shown) + 32 * kEps * view.focal_length_px() * shift.norm() / distance);
  });
}

TEST(Property, AHyperboloidsSlopesComeBack) {
  hold("slope(point at elevation(s)) == s", [] {
    const double a = *scales(0.005, 0.2);
    const double c = a * (1 + *scales(0.05, 5));
    const vision::HyperboloidMirror mirror({a, c, a * *number(0.3, 4)});
    const double slope = *number(0.001, 0.99) * mirror.rim_slope();
    const double e = mirror.elevation_rad(slope).value();
    const double way = c * *scales(30, 1e5);
    const auto again = mirror.slope(way * std::cos(e), mirror.viewpoint_m() + way * std::sin(e));
    RC_ASSERT(again.has_value());
    // An angle of up to pi / 2 is rounded, and the slope changes with it: ds/de is the reciprocal of the forward
    // derivative, which this difference gives.
    const double step = 1e-6 * mirror.rim_slope();
    const double rise = (*mirror.elevation_rad(slope) - *mirror.elevation_rad(slope - step)) / step;
    // Elevation and slope both have roundings; near the asymptote b^2 / towards cancels as 1 / (1 - a s ...).
    RC_NEAR(*again, slope, 64 * kEps * (std::numbers::pi / rise + slope) * (1 + c / (c - a)));
  });
}

TEST(Property, WrappingIsIdempotentAndOdd) {
  hold("wrap(wrap(x)) == wrap(x), inside (-pi, pi], odd, and x again plus whole turns", [] {
    const double x = *scales(1e-9, 1e9) * (*rc::gen::arbitrary<bool>() ? 1 : -1);
    const double w = localisation::wrap_angle_rad(x);
    RC_ASSERT(std::abs(w) <= std::numbers::pi);
    RC_ASSERT(localisation::wrap_angle_rad(w) == w);
    RC_ASSERT(localisation::wrap_angle_rad(-x) == -w);
    RC_NEAR(std::sin(w), std::sin(x), 4 * kEps);
    RC_NEAR(std::cos(w), std::cos(x), 4 * kEps);
  });
}

struct Drive {
  localisation::WheelGeometry wheels;
  localisation::Pose start;
  double left_rad, right_rad;
};

Drive any_drive() {
  return {{*scales(0.01, 0.3), *scales(0.05, 1)},
          {*number(-5, 5), *number(-5, 5), *number(-3, 3)},
          *number(-20, 20),
          *number(-20, 20)};
}

/// A few roundings of the place, of the distance and, by the distance, of the turned angle.
double arc_rounding(const Drive& d) {
  const double way = d.wheels.radius_m * (std::abs(d.left_rad) + std::abs(d.right_rad));
  return 32 * kEps * (8 + way + way * (3 + way / d.wheels.separation_m));
}

localisation::Pose drive(const Drive& d, int parts) {
  localisation::Odometry odometry(d.wheels, d.start);
  odometry.update(0, 0);
  for (int i = 1; i < parts; ++i) odometry.update(d.left_rad * i / parts, d.right_rad * i / parts);
  return odometry.update(d.left_rad, d.right_rad);
}

void rc_near(const localisation::Pose& a, const localisation::Pose& b, double tolerance) {
  RC_NEAR(a.x_m, b.x_m, tolerance);
  RC_NEAR(a.y_m, b.y_m, tolerance);
  RC_NEAR(std::remainder(a.heading_rad - b.heading_rad, 2 * std::numbers::pi), 0.0, tolerance);
}

TEST(Property, AnArcIsTheSumOfItsParts) {
  hold("in n parts as in one", [] {
    const Drive d = any_drive();
    const int parts = *rc::gen::inRange(2, 20);
    rc_near(drive(d, 1), drive(d, parts), arc_rounding(d) * parts);
  });
}

TEST(Property, DrivingBackComesBack) {
  hold("there and back is nowhere", [] {
    const Drive d = any_drive();
    localisation::Odometry odometry(d.wheels, d.start);
    odometry.update(0, 0);
    odometry.update(d.left_rad, d.right_rad);
    rc_near(odometry.update(0, 0), d.start, arc_rounding(d));
  });
}

TEST(Property, AnArcTurnsAndMovesWithItsStart) {
  hold("start turned and shifted: the end is, too", [] {
    const Drive d = any_drive();
    Drive origin = d;
    origin.start = {};
    const localisation::Pose from_origin = drive(origin, 1);
    const Eigen::Vector2d way =
        Eigen::Rotation2Dd(d.start.heading_rad) * Eigen::Vector2d(from_origin.x_m, from_origin.y_m);
    rc_near(drive(d, 1), {d.start.x_m + way.x(), d.start.y_m + way.y(), d.start.heading_rad + from_origin.heading_rad},
            arc_rounding(d));
  });
}

TEST(Property, SwappedWheelsMirrorTheArc) {
  hold("left and right swapped: y and heading change sign, bit by bit", [] {
    Drive d = any_drive();
    d.start = {*number(-5, 5), 0, 0};
    const localisation::Pose plain = drive(d, 1);
    std::swap(d.left_rad, d.right_rad);
    RC_ASSERT(drive(d, 1) == (localisation::Pose{plain.x_m, -plain.y_m, -plain.heading_rad}));
  });
}

/// Three landmarks about a robot, no two of which are seen in nearly one line: then every corner is well placed.
std::vector<localisation::LandmarkRange> any_ranges(double* least_sine) {
  std::vector<localisation::LandmarkRange> ranges;
  const Eigen::Vector2d robot(*number(-3, 3), *number(-3, 3));
  for (int i = 0; i < 3; ++i) {
    const double direction = *number(-std::numbers::pi, std::numbers::pi);
    const double range = *number(0.3, 6);
    ranges.push_back({robot + range * Eigen::Vector2d(std::cos(direction), std::sin(direction)), range});
  }
  *least_sine = 1;
  for (const auto& [a, b] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
    const Eigen::Vector2d u = (ranges[std::size_t(a)].landmark_m - robot) / ranges[std::size_t(a)].range_m;
    const Eigen::Vector2d v = (ranges[std::size_t(b)].landmark_m - robot) / ranges[std::size_t(b)].range_m;
    *least_sine = std::min(*least_sine, std::abs(u.x() * v.y() - u.y() * v.x()));
  }
  RC_PRE(*least_sine > 0.02);
  return ranges;
}

TEST(Property, TheTrianglesFixMovesWithTheWorld) {
  hold("world turned and shifted: so is the fix; landmarks in another order: the same fix", [] {
    double least_sine = 1;
    auto ranges = any_ranges(&least_sine);
    const localisation::Fix fix = localisation::fix_by_triangle(ranges);
    RC_ASSERT(fix.verdict == localisation::FixVerdict::kOk);
    const double turn = *number(-std::numbers::pi, std::numbers::pi);
    const double far = *scales(1e-3, 1e6);
    const Eigen::Vector2d shift = far * Eigen::Vector2d(*number(-1, 1), *number(-1, 1));
    // Lengths of up to 20 m, coordinates of up to `far`; a corner's condition is 1 / sine of its angle.
    const double tolerance = 64 * kEps * (20 + far) / least_sine;
    auto moved = ranges;
    for (auto& r : moved) r.landmark_m = Eigen::Rotation2Dd(turn) * r.landmark_m + shift;
    const localisation::Fix moved_fix = localisation::fix_by_triangle(moved);
    RC_ASSERT(moved_fix.position_m.has_value());
    RC_NEAR((*moved_fix.position_m - (Eigen::Rotation2Dd(turn) * *fix.position_m + shift)).norm(), 0.0, tolerance);
    std::swap(ranges[0], ranges[std::size_t(*rc::gen::inRange(1, 3))]);
    std::swap(ranges[1], ranges[2]);
    RC_NEAR((*localisation::fix_by_triangle(ranges).position_m - *fix.position_m).norm(), 0.0,
            64 * kEps * 20 / least_sine);
  });
}

TEST(Property, TheLeastSquaresFixMovesWithTheWorld) {
  hold("world turned and shifted: so is the fix; landmarks in another order: the same fix", [] {
    double least_sine = 1;
    const auto ranges = any_ranges(&least_sine);
    RC_PRE(least_sine > 0.2);
    std::vector<localisation::LandmarkMeasurement> m;
    for (const auto& r : ranges) {
      const double sigma = *scales(1e-3, 1e-1);
      m.push_back({r.landmark_m, r.range_m + *number(-0.3, 0.3) * sigma, std::nullopt,
                   sigma * sigma * Eigen::Matrix2d::Identity()});
    }
    const localisation::Fix fix = localisation::fix_by_least_squares(m);
    RC_PRE(fix.verdict == localisation::FixVerdict::kOk);
    const double turn = *number(-std::numbers::pi, std::numbers::pi);
    const double far = *scales(1e-3, 1e6);
    const Eigen::Vector2d shift = far * Eigen::Vector2d(*number(-1, 1), *number(-1, 1));
    // As for the triangle; sigmas of 1 to 100 reduce the weight of the least accurate of three ranges to a hundredth.
    const double tolerance = 64 * kEps * (20 + far) / least_sine * 100;
    auto moved = m;
    for (auto& one : moved) one.landmark_m = Eigen::Rotation2Dd(turn) * one.landmark_m + shift;
    const localisation::Fix moved_fix = localisation::fix_by_least_squares(moved);
    RC_ASSERT(moved_fix.position_m.has_value());
    RC_NEAR((*moved_fix.position_m - (Eigen::Rotation2Dd(turn) * *fix.position_m + shift)).norm(), 0.0, tolerance);
    std::swap(m[0], m[std::size_t(*rc::gen::inRange(1, 3))]);
    std::swap(m[1], m[2]);
    RC_NEAR((*localisation::fix_by_least_squares(m).position_m - *fix.position_m).norm(), 0.0,
            64 * kEps * 20 / least_sine * 100);
  });
}

TEST(Property, ALandmarkThatBothViewsShowIsTriangulated) {
  hold("triangulate(project(near point)) is the landmark, its top known or not", [] {
    vision::MirrorViewSettings s = any_view();
    s.cone = {*number(1.3, 1.8), 0.06, 0.12};
    s.lens_height_m = 0.25;
    s.rim_radius_px = 236;
    s.tilt_rad /= 10;
    s.axis_offset_m /= 10;
    vision::MirrorViewSettings above = s;
    above.lens_height_m = 0.55;
    const vision::Rig rig{vision::MirrorView(s), vision::MirrorView(above)};
    const double range = *number(1.5, 8);
    const double bearing = *number(-3, 3);
    const double radius = *number(0.02, 0.2);
    const double top = *number(0.9, 2);
    std::array<vision::Sighting, 2> sightings;
    for (std::size_t i = 0; i < 2; ++i) {
      const vision::MirrorView& view = i == 0 ? rig.lower : rig.upper;
      const auto near =
          vision::near_top_point(view, {range * std::cos(bearing), range * std::sin(bearing)}, radius, top);
      const auto pixel = near ? view.project(*near) : std::nullopt;
      RC_PRE(pixel.has_value());
      sightings[i].pixel_px = *pixel;
      sightings[i].covariance_px2 = 1e-4 * Eigen::Matrix2d::Identity();
    }
    const bool top_known = *rc::gen::arbitrary<bool>();
    const auto t =
        vision::triangulate(rig, &sightings[0], &sightings[1], radius, top_known ? std::optional(top) : std::nullopt);
    RC_ASSERT(t.verdict == vision::RangeVerdict::kOk);
    // Pixels of up to 1,000 are rounded, compared with a sigma of 0.01; the fit ends within a billionth of a sigma.
    const double sigmas = 64 * kEps * 1000 / 0.01 + 1e-9;
    RC_NEAR(*t.range_m, range, sigmas * std::sqrt((*t.covariance)(0, 0)));
    RC_NEAR(*t.bearing_rad, bearing, sigmas * std::sqrt((*t.covariance)(1, 1)));
  });
}

}  // namespace
}  // namespace twocone
