// SPDX-License-Identifier: Apache-2.0
// Huge, tiny, denormal, NaN and infinite input, and degenerate geometry, for every public numerical function: each call
// ends, and its result is a verdict, nothing, or finite numbers, never a NaN that looks like an answer.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"
#include "localisation/paper_trilateration.h"
#include "tests/numerics/judge.h"
#include "tests/support/disparity_range.h"
#include "tests/support/hyperboloid_mirror.h"
#include "tests/support/special_doubles.h"
#include "vision/mirror_view.h"
#include "vision/rim.h"
#include "vision/triangulation.h"

namespace twocone {
namespace {

using localisation::Fix;
using localisation::FixVerdict;
using localisation::LandmarkRange;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

constexpr double kMax = std::numeric_limits<double>::max();
constexpr double kMin = std::numeric_limits<double>::min();
constexpr double kDenormal = std::numeric_limits<double>::denorm_min();

constexpr std::array kHostile = {0.0,   -0.0,  kDenormal, -kDenormal, kMin,  1e-200, 1e-160, 1e-77,
                                 1e-17, 1e-9,  0.37,      -0.37,      1.0,   1e9,    -1e9,   1e17,
                                 1e77,  1e155, 1e200,     kMax,       -kMax, kInf,   -kInf,  kNaN};

/// Draws ordinary numbers mostly, and extreme ones sometimes.
double draw_any(exact::Draw& draw) {
  if (draw.uniform(0, 1) < 0.5) return draw.uniform(-5, 5);
  return kHostile[static_cast<std::size_t>(draw.uniform(0, double(kHostile.size())))];
}
double draw_positive(exact::Draw& draw) { return std::abs(draw_any(draw)); }

constexpr int kCases = 20000;

TEST(Degenerate, AMirrorViewIsRefusedOrAnswersFiniteNumbers) {
  exact::Draw draw(40700);
  int accepted = 0;
  for (int i = 0; i < kCases; ++i) {
    vision::MirrorViewSettings s;
    s.cone = {draw.uniform(0, 1) < 0.5 ? draw.uniform(0.01, 3.13) : draw_any(draw), draw_positive(draw),
              draw_positive(draw)};
    s.lens_height_m = draw_any(draw);
    s.centre_px = {draw_any(draw), draw_any(draw)};
    s.rim_radius_px = draw_positive(draw);
    s.azimuth_rad = draw_any(draw);
    s.mirrored = draw.coin();
    if (draw.coin()) s.tilt_rad = {draw_any(draw), draw_any(draw)};
    if (draw.coin()) s.axis_offset_m = {draw_any(draw), draw_any(draw)};
    std::optional<vision::MirrorView> view;
    try {
      view.emplace(s);
    } catch (const std::invalid_argument&) {
      continue;
    }
    ++accepted;
    const Eigen::Vector3d p(draw_any(draw), draw_any(draw), draw_any(draw));
    const std::string what = fmt::format(
        "case {}: apex {} R {} d {} lens {} centre {} {} rim {} azimuth {} tilt {} {} offset {} {}; at {} {} {}", i,
        s.cone.apex_rad, s.cone.rim_radius_m, s.cone.lens_to_tip_m, s.lens_height_m, s.centre_px.x(), s.centre_px.y(),
        s.rim_radius_px, s.azimuth_rad, s.tilt_rad.x(), s.tilt_rad.y(), s.axis_offset_m.x(), s.axis_offset_m.y(), p.x(),
        p.y(), p.z());
    if (const auto radius = view->image_radius_px(std::abs(p.x()), p.z())) {
      EXPECT_TRUE(std::isfinite(*radius) && *radius > 0) << *radius << " px, " << what;
    }
    if (const auto pixel = view->project(p)) {
      EXPECT_TRUE(pixel->allFinite()) << pixel->transpose() << ", " << what;
    }
    if (const auto ray = view->back_project({p.x(), p.y()})) {
      EXPECT_TRUE(ray->origin_m.allFinite() && ray->direction.allFinite())
          << ray->origin_m.transpose() << ", " << ray->direction.transpose() << ", " << what;
    }
    if (const auto ray = view->back_project(s.centre_px + Eigen::Vector2d(s.rim_radius_px / 3, s.rim_radius_px / 7))) {
      EXPECT_TRUE(ray->origin_m.allFinite() && ray->direction.allFinite())
          << ray->origin_m.transpose() << ", " << ray->direction.transpose() << ", inside the rim, " << what;
    }
  }
  EXPECT_GT(accepted, 100);
}

TEST(Degenerate, AHyperboloidIsRefusedOrAnswersFiniteNumbers) {
  exact::Draw draw(40701);
  int accepted = 0;
  for (int i = 0; i < kCases; ++i) {
    std::optional<vision::HyperboloidMirror> mirror;
    const double a = draw_positive(draw);
    const double c = draw.coin() ? a * (1 + draw.scales(1e-17, 10)) : draw_positive(draw);
    const double rim = draw_positive(draw);
    try {
      mirror.emplace(vision::HyperboloidMirrorSettings{a, c, rim});
    } catch (const std::invalid_argument&) {
      continue;
    }
    ++accepted;
    const double x = draw_any(draw);
    const double y = draw_any(draw);
    const std::string what = fmt::format("case {}: a {} c {} rim {}, at {} {}", i, a, c, rim, x, y);
    if (const auto slope = mirror->slope(x, y)) {
      EXPECT_TRUE(std::isfinite(*slope) && *slope >= 0) << *slope << ", " << what;
    }
    for (const double slope : {x, mirror->rim_slope(), mirror->rim_slope() / 3}) {
      if (const auto e = mirror->elevation_rad(slope)) {
        EXPECT_TRUE(std::isfinite(*e)) << *e << " at slope " << slope << ", " << what;
      }
    }
  }
  EXPECT_GT(accepted, 100);
}

TEST(Degenerate, AWrappedAngleIsInsideOrNaN) {
  for (const double angle : kHostile) {
    const double wrapped = localisation::wrap_angle_rad(angle);
    if (std::isfinite(angle)) {
      EXPECT_LE(std::abs(wrapped), std::numbers::pi) << angle;
    } else {
      EXPECT_TRUE(std::isnan(wrapped)) << angle;
    }
  }
}

TEST(Degenerate, OdometryRefusesOrStaysFinite) {
  exact::Draw draw(40702);
  int moved = 0;
  for (int i = 0; i < kCases; ++i) {
    const std::array x = {draw_positive(draw), draw_positive(draw), draw_any(draw), draw_any(draw), draw_any(draw),
                          draw_any(draw),      draw_any(draw),      draw_any(draw), draw_any(draw)};
    try {
      localisation::Odometry odometry({x[0], x[1]}, {x[2], x[3], x[4]});
      odometry.update(x[5], x[6]);
      const localisation::Pose& pose = odometry.update(x[7], x[8]);
      ++moved;
      EXPECT_TRUE(std::isfinite(pose.x_m) && std::isfinite(pose.y_m) && std::isfinite(pose.heading_rad))
          << "case " << i << ": " << exact::describe({x.begin(), x.end()}) << " -> " << pose.x_m << ", " << pose.y_m
          << ", " << pose.heading_rad;
    } catch (const std::invalid_argument&) {
    }
  }
  EXPECT_GT(moved, 100);
}

void expect_sound(const Fix& fix, const std::string& what) {
  const bool given = fix.verdict == FixVerdict::kOk || fix.verdict == FixVerdict::kGap ||
                     fix.verdict == FixVerdict::kAmbiguous || fix.verdict == FixVerdict::kWeak;
  EXPECT_EQ(given, fix.position_m.has_value()) << to_string(fix.verdict) << ", " << what;
  EXPECT_EQ(fix.verdict == FixVerdict::kAmbiguous, fix.other_position_m.has_value()) << what;
  if (fix.position_m) {
    EXPECT_TRUE(fix.position_m->allFinite()) << fix.position_m->transpose() << ", " << what;
  }
  if (fix.other_position_m) {
    EXPECT_TRUE(fix.other_position_m->allFinite()) << fix.other_position_m->transpose() << ", " << what;
  }
  if (fix.heading_rad) {
    EXPECT_TRUE(std::abs(*fix.heading_rad) <= std::numbers::pi) << *fix.heading_rad << ", " << what;
  }
  if (fix.other_heading_rad) {
    EXPECT_TRUE(std::abs(*fix.other_heading_rad) <= std::numbers::pi) << what;
  }
  if (fix.covariance) {
    EXPECT_TRUE(fix.covariance->allFinite()) << *fix.covariance << ", " << what;
  }
  if (fix.other_covariance) {
    EXPECT_TRUE(fix.other_covariance->allFinite()) << what;
  }
  if (fix.unseen_direction) {
    EXPECT_NEAR(fix.unseen_direction->norm(), 1, 1e-12) << what;
  }
  EXPECT_TRUE(std::isfinite(fix.chi_squared) && fix.chi_squared >= 0) << fix.chi_squared << ", " << what;
}

TEST(Degenerate, TheTrianglesFixIsFiniteOrAVerdict) {
  exact::Draw draw(40703);
  for (int i = 0; i < kCases; ++i) {
    std::vector<LandmarkRange> ranges;
    std::string what = fmt::format("case {}:", i);
    for (int k = 0; k < 3 + i % 3; ++k) {
      ranges.push_back({{draw_any(draw), draw_any(draw)}, draw_positive(draw)});
      what += fmt::format(" ({:.17g}, {:.17g}) {:.17g};", ranges.back().landmark_m.x(), ranges.back().landmark_m.y(),
                          ranges.back().range_m);
    }
    expect_sound(localisation::fix_by_triangle(ranges), what);
  }
}

/// Degenerate places in units of `unit`: parallel (in line), coincident, tangent, and all of these at once.
std::vector<std::vector<LandmarkRange>> degenerate_places(double unit) {
  std::vector<std::vector<LandmarkRange>> places = {
      {{{0, 0}, 1}, {{2, 0}, 1}, {{5, 0}, 4}},              // in line, the robot too
      {{{0, 0}, 2}, {{2, 0}, 2}, {{5, 0}, 4.3}},            // in line, but not the robot
      {{{0, 0}, 1}, {{0, 0}, 1}, {{0, 0}, 1}},              // one place
      {{{0, 0}, 1}, {{0, 0}, 2}, {{3, 0}, 2.5}},            // one place, two ranges
      {{{0, 0}, 1}, {{0, 0}, 1}, {{1, 1}, 1}},              // two places
      {{{0, 0}, 0}, {{0, 0}, 0}, {{0, 0}, 0}},              // all numbers 0
      {{{0, 0}, 0.1}, {{0.3, 0}, 0.2}, {{0.1, 0.4}, 0.4}},  // tangent from outside
      {{{0, 0}, 3}, {{1, 0}, 2}, {{3, 4}, 4}},              // tangent from inside
      {{{0, 0}, 3}, {{1, 0}, 2}, {{2, 0}, 1}},              // all tangent in one point, in line
      {{{0, 0}, 0}, {{4, 0}, 4}, {{0, 3}, 3}},              // on a landmark
      {{{0, 0}, 1}, {{1e-17, 0}, 1}, {{0, 1}, 1}},          // centres nearer than an eps
      {{{0, 0}, 1}, {{100, 0}, 1}, {{0, 100}, 1}},          // none meet
      {{{0, 0}, 100}, {{1, 0}, 1}, {{0, 1}, 2}},            // each inside the other
  };
  for (auto& place : places) {
    for (LandmarkRange& r : place) r = {r.landmark_m * unit, r.range_m * unit};
  }
  return places;
}

TEST(Degenerate, TheTrianglesFixDoesNotMindTheUnit) {
  // Scaling by a power of two changes nothing except for overflow and underflow, so the answer must not change either.
  const auto plain = degenerate_places(1);
  for (const int power : {-1000, -520, -300, 300, 500, 980}) {
    const double unit = std::ldexp(1.0, power);
    const auto scaled = degenerate_places(unit);
    for (std::size_t i = 0; i < plain.size(); ++i) {
      const Fix one = localisation::fix_by_triangle(plain[i]);
      const Fix other = localisation::fix_by_triangle(scaled[i]);
      const std::string what = fmt::format("place {} in units of 2^{}", i, power);
      expect_sound(other, what);
      EXPECT_EQ(one.verdict, other.verdict) << what;
      if (!one.position_m || !other.position_m) continue;
      EXPECT_LE((*one.position_m - *other.position_m / unit).norm(), 1e-15 * (1 + one.position_m->norm())) << what;
    }
  }
}

TEST(Degenerate, TheLeastSquaresFixIsFiniteOrAVerdict) {
  exact::Draw draw(40704);
  for (int i = 0; i < kCases / 4; ++i) {
    std::vector<localisation::LandmarkMeasurement> measurements;
    std::string what = fmt::format("case {}:", i);
    for (int k = 0; k < 2 + i % 4; ++k) {
      localisation::LandmarkMeasurement m;
      m.landmark_m = {draw_any(draw), draw_any(draw)};
      if (draw.coin()) m.range_m = draw_any(draw);
      if (draw.coin()) m.bearing_rad = draw_any(draw);
      m.covariance << draw_positive(draw), draw_any(draw), 0, draw_positive(draw);
      m.covariance(1, 0) = m.covariance(0, 1) = draw.coin() ? 0 : m.covariance(0, 1);
      what += fmt::format(" ({:.17g}, {:.17g}) range {:.17g} bearing {:.17g} covariance {:.17g} {:.17g} {:.17g};",
                          m.landmark_m.x(), m.landmark_m.y(), m.range_m.value_or(kNaN), m.bearing_rad.value_or(kNaN),
                          m.covariance(0, 0), m.covariance(0, 1), m.covariance(1, 1));
      measurements.push_back(m);
    }
    expect_sound(localisation::fix_by_least_squares(measurements), what);
  }
}

TEST(Degenerate, APoseBoundIsFiniteOrNothing) {
  exact::Draw draw(40705);
  for (int i = 0; i < kCases / 4; ++i) {
    std::vector<Eigen::Vector2d> landmarks;
    std::vector<Eigen::Matrix2d> information;
    for (int k = 0; k < i % 5; ++k) {
      landmarks.emplace_back(draw_any(draw), draw_any(draw));
      Eigen::Matrix2d info;
      info << draw_positive(draw), 0, 0, draw_positive(draw);
      information.push_back(info);
    }
    const auto bound =
        localisation::pose_bound({draw_any(draw), draw_any(draw), draw.uniform(-3, 3)}, landmarks, information);
    if (bound) {
      EXPECT_TRUE(bound->allFinite() && bound->diagonal().minCoeff() >= 0) << "case " << i << ":\n" << *bound;
    }
  }
}

TEST(Degenerate, ARangeFromDisparityIsFiniteOrAVerdict) {
  exact::Draw draw(40706);
  int answered = 0;
  for (int i = 0; i < kCases; ++i) {
    const double disparity = draw_any(draw);
    const double sigma = draw_any(draw);
    const vision::DisparityGeometry g{draw_any(draw), draw_any(draw), draw_any(draw), draw_any(draw)};
    const std::string what = fmt::format("case {}: {} px, sigma {}, v {} s {} d {} r_m {}", i, disparity, sigma,
                                         g.focal_length_px, g.mirror_separation_m, g.lens_to_tip_m, g.rim_radius_px);
    try {
      const vision::InverseRange r = vision::range_from_disparity(disparity, sigma, g);
      ++answered;
      EXPECT_EQ(r.verdict == vision::RangeVerdict::kOk, r.range_m.has_value()) << what;
      EXPECT_TRUE(std::isfinite(r.inverse_per_m) && std::isfinite(r.sigma_inverse_per_m)) << what;
      if (r.range_m) {
        EXPECT_TRUE(*r.range_m > 0 && std::isfinite(*r.range_m) && std::isfinite(*r.sigma_range_m)) << what;
      }
    } catch (const std::invalid_argument&) {
    }
  }
  EXPECT_GT(answered, 100);
}

TEST(Degenerate, ATriangulationIsFiniteOrAVerdict) {
  vision::MirrorViewSettings s{.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
                               .lens_height_m = 0.25,
                               .centre_px = {319.5, 239.5},
                               .rim_radius_px = 236};
  vision::MirrorViewSettings above = s;
  above.lens_height_m = 0.55;
  const vision::Rig rig{vision::MirrorView(s), vision::MirrorView(above)};
  exact::Draw draw(40707);
  for (int i = 0; i < kCases / 4; ++i) {
    std::array<vision::Sighting, 2> sightings;
    for (auto& sighting : sightings) {
      sighting.pixel_px = draw.coin() ? Eigen::Vector2d(319.5 + draw.uniform(-240, 240), 239.5 + draw.uniform(-9, 9))
                                      : Eigen::Vector2d(draw_any(draw), draw_any(draw));
      sighting.covariance_px2 = Eigen::Vector2d(draw_positive(draw), draw_positive(draw)).asDiagonal();
    }
    const double radius = draw_any(draw);
    const auto top = draw.coin() ? std::optional(draw_any(draw)) : std::nullopt;
    const std::string what =
        fmt::format("case {}: ({}, {}) +- {} {}, ({}, {}) +- {} {}, radius {}, top {}", i, sightings[0].pixel_px.x(),
                    sightings[0].pixel_px.y(), sightings[0].covariance_px2(0, 0), sightings[0].covariance_px2(1, 1),
                    sightings[1].pixel_px.x(), sightings[1].pixel_px.y(), sightings[1].covariance_px2(0, 0),
                    sightings[1].covariance_px2(1, 1), radius, top.value_or(kNaN));
    try {
      const vision::Triangulation t = vision::triangulate(rig, draw.coin() ? &sightings[0] : nullptr,
                                                          draw.coin() ? &sightings[1] : nullptr, radius, top);
      const bool given = t.verdict == vision::RangeVerdict::kOk || t.verdict == vision::RangeVerdict::kOneView;
      EXPECT_EQ(given, t.range_m.has_value()) << what;
      EXPECT_TRUE(!t.range_m || (std::isfinite(*t.range_m) && *t.range_m > 0)) << what;
      EXPECT_TRUE(!t.bearing_rad || std::abs(*t.bearing_rad) <= std::numbers::pi) << what;
      EXPECT_TRUE(!t.covariance || t.covariance->allFinite()) << what;
      EXPECT_TRUE(!t.top_m || std::isfinite(*t.top_m)) << what;
      EXPECT_TRUE(!t.disparity_px || std::isfinite(*t.disparity_px)) << what;
    } catch (const std::invalid_argument&) {
    }
  }
}

TEST(Degenerate, TheRimFinderEndsOnAnyExpectation) {
  const cv::Mat even(64, 64, CV_8UC3, cv::Scalar(90, 90, 90));
  for (const double x : kHostile) {
    for (const double r : kHostile) {
      for (const vision::RimCircle& expected : {vision::RimCircle{{x, 31}, r, 0}, vision::RimCircle{{31, x}, r, 0}}) {
        const std::string what =
            fmt::format("about {}, {}, radius {}", expected.centre_px.x(), expected.centre_px.y(), r);
        if (std::isfinite(x) && std::isfinite(r) && r > 0) {
          EXPECT_FALSE(vision::find_rim(even, expected)) << what;
        } else {
          EXPECT_THROW((void)vision::find_rim(even, expected), std::invalid_argument) << what;
        }
      }
    }
  }
}

}  // namespace
}  // namespace twocone
