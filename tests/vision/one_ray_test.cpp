// SPDX-License-Identifier: Apache-2.0
// Images whose pixels are one ray each, as a renderer without anti-aliasing makes them: the posterior of a landmark's
// place, compared with the polygon of the places that agree with every pixel; and how often its ellipses hold the
// truth. TWOCONE_POSES=2000 runs the full test.
#include "vision/outline/one_ray.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "localisation/least_squares_fix.h"
#include "tests/support/srgb.h"
#include "tests/support/synthetic_lab.h"
#include "tests/vision/lab_rig.h"
#include "vision/bound.h"
#include "vision/outline_ranging.h"

namespace twocone::vision {
namespace {

using testing_support::seen_from;
using testing_support::six_landmarks;
using testing_support::SyntheticLandmark;
using testing_support::targets_of;

constexpr double kLevel = 0.45;  // of the background, linear
constexpr double kChi2_2dof_95 = 5.991464547;

// ---- the posterior against the polygon

using Polygon = std::vector<Eigen::Vector2d>;

/// Returns the part of a convex polygon where offset + normal . place is > 0.
Polygon clipped(const Polygon& polygon, double offset, const Eigen::Vector2d& normal) {
  Polygon inside;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double at_a = offset + normal.dot(a);
    const double at_b = offset + normal.dot(b);
    if (at_a > 0) inside.push_back(a);
    if ((at_a > 0) != (at_b > 0)) inside.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return inside;
}

struct Uniform {
  Eigen::Vector2d mean;
  Eigen::Matrix2d covariance;
};
/// Returns the moments of the uniform density on a polygon, by triangles from its first vertex.
Uniform uniform_on(const Polygon& polygon) {
  double area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const std::array<Eigen::Vector2d, 3> p{polygon[0], polygon[i], polygon[i + 1]};
    const Eigen::Vector2d u = p[1] - p[0];
    const Eigen::Vector2d v = p[2] - p[0];
    const double part = (u.x() * v.y() - u.y() * v.x()) / 2;
    const Eigen::Vector2d sum = p[0] + p[1] + p[2];
    area += part;
    first += part * sum / 3;
    // The second moment of a triangle: (sum of p p^T + (sum of p) (sum of p)^T) / 12.
    second += part / 12 * sum * sum.transpose();
    for (const Eigen::Vector2d& q : p) second += part / 12 * q * q.transpose();
  }
  const Eigen::Vector2d mean = first / area;
  return {mean, second / area - mean * mean.transpose()};
}

/// A vertex that moves by one pixel for each unit of range and of bearing.
const Outline::Vertex kUnitVertex{.pixel_px = {0, 0},
                                  .by_range_pxpm = {1, 0},
                                  .by_bearing_pxprad = {0, 1},
                                  .by_width_px = {0, 0},
                                  .by_height_pxpm = {0, 0},
                                  .by_lean_px = {0, 0},
                                  .bulge_px = {0, 0},
                                  .chord_px = 1,
                                  .width_px = 1};

TEST(OneRay, WithoutErrorsThePosteriorIsUniformOnThePolygonThatAgreesWithEveryPixel) {
  // 60 pixels along outlines of all directions: polygons some 20 times as large as the least tolerance, which blurs
  // them a little. The grid has 12 places across 6.4 sigmas, so a polygon's border is known to a quarter of a sigma;
  // over the border the errors average to half of that.
  constexpr int kPixels = 60;
  constexpr double kMeanError = 0.15;   // of a sigma
  constexpr double kSigmaError = 0.15;  // of a sigma
  std::mt19937_64 random(20261125);
  std::uniform_real_distribution<double> beside_px(-1, 1);
  std::uniform_real_distribution<double> direction_rad(-3.1, 3.1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector2d truth(0.11 * beside_px(random), 0.13 * beside_px(random));
    EdgeSamples read;
    Polygon polygon{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int i = 0; i < kPixels; ++i) {
      const double angle_rad = direction_rad(random);
      const Eigen::Vector2d moves(std::cos(angle_rad), std::sin(angle_rad));
      const double offset = beside_px(random);
      const bool is_inside = offset + moves.dot(truth) > 0;
      EdgeSample s{};
      s.is_usable = true;
      s.wide = 1;
      s.by_range_pxpm = static_cast<float>(moves.x());
      s.by_bearing_pxprad = static_cast<float>(moves.y());
      s.first = i;
      s.count = 1;
      read.edge_samples.push_back(s);
      read.pixels.push_back({static_cast<float>(offset), is_inside ? 1.F : 0.F, 1, is_inside});
      polygon = clipped(polygon, is_inside ? offset : -offset, is_inside ? moves : Eigen::Vector2d(-moves));
    }
    OutlineFit fit;
    for (auto& vertex : fit.outline.vertices) vertex = kUnitVertex;
    fit.outline.near = kUnitVertex;
    fit.step.setZero();
    fit.information = Eigen::Matrix2d::Identity() / (0.1 * 0.1);
    const auto fits = fit_one_ray(read, fit);
    ASSERT_TRUE(fits) << "trial " << trial;
    const OneRayFit& posterior = fits->by_tolerance.back();
    const Uniform expected = uniform_on(polygon);
    const Eigen::LLT<Eigen::Matrix2d> factor(expected.covariance);
    EXPECT_LT(factor.matrixL().solve(posterior.step - expected.mean).norm(), kMeanError) << "trial " << trial;
    const Eigen::Matrix2d root = factor.matrixL().solve(Eigen::Matrix2d::Identity());
    const Eigen::Vector2d shares =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(root * posterior.covariance * root.transpose()).eigenvalues();
    EXPECT_NEAR(std::sqrt(shares[0]), 1, kSigmaError) << "trial " << trial;
    EXPECT_NEAR(std::sqrt(shares[1]), 1, kSigmaError) << "trial " << trial;
    // A larger tolerance explains the same pixels less well.
    EXPECT_GT(posterior.log_evidence, fits->by_tolerance.front().log_evidence) << "trial " << trial;
  }
}

TEST(OneRay, PixelsThatContradictEachOtherNeedALargeTolerance) {
  // A straight side seen by 200 pixels whose statements are those of an edge that wavers by 0.1 px.
  constexpr double kWaver_px = 0.1;
  std::mt19937_64 random(20261126);
  std::uniform_real_distribution<double> beside_px(-1, 1);
  EdgeSamples read;
  for (int i = 0; i < 200; ++i) {
    EdgeSample s{};
    s.is_usable = true;
    s.wide = 1;
    s.by_range_pxpm = i % 2 == 0 ? 1.F : 0.2F;
    s.by_bearing_pxprad = i % 2 == 0 ? 0.2F : 1.F;
    s.first = i;
    s.count = 1;
    read.edge_samples.push_back(s);
    const double offset = beside_px(random);
    const bool is_inside = offset + kWaver_px * beside_px(random) > 0;
    read.pixels.push_back({static_cast<float>(offset), is_inside ? 1.F : 0.F, 1, is_inside});
  }
  OutlineFit fit;
  for (auto& vertex : fit.outline.vertices) vertex = kUnitVertex;
  fit.outline.near = kUnitVertex;
  fit.step.setZero();
  fit.information = Eigen::Matrix2d::Identity() / (0.1 * 0.1);
  const auto fits = fit_one_ray(read, fit);
  ASSERT_TRUE(fits);
  const auto best =
      std::max_element(fits->by_tolerance.begin(), fits->by_tolerance.end(),
                       [](const OneRayFit& a, const OneRayFit& b) { return a.log_evidence < b.log_evidence; });
  EXPECT_EQ(kTolerances_px[std::size_t(best - fits->by_tolerance.begin())], kWaver_px);
  EXPECT_LT(best->step.norm(), 5 * std::sqrt(best->covariance.trace()));
}

// ---- whole images

/// Returns the image of a view with one ray through the centre of each pixel. The landmarks are lit from one side.
cv::Mat one_ray_image(const MirrorView& view, const std::vector<SyntheticLandmark>& landmarks) {
  cv::Mat image(kImage, CV_8UC3, cv::Scalar::all(0));
  const auto code = [](double linear) {
    return static_cast<std::uint8_t>(std::lround(testing_support::coded(linear)));
  };
  const cv::Vec3b background = cv::Vec3b::all(code(kLevel));
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const auto ray = view.back_project({double(column), double(row)});
      if (!ray) continue;
      cv::Vec3b& pixel = image.at<cv::Vec3b>(row, column);
      pixel = background;
      double nearest_m = 1e9;
      for (const SyntheticLandmark& l : landmarks) {
        const auto height_m = Solid{l.centre_m, l.radius_m, l.top_m}.hit_height_m(*ray);
        if (!height_m || l.centre_m.norm() > nearest_m) continue;
        nearest_m = l.centre_m.norm();
        const Eigen::Vector2d away = l.centre_m.normalized();
        const double aside = away.x() * ray->direction.y() - away.y() * ray->direction.x();
        const double shade = 0.85 + 0.15 * std::clamp(aside * nearest_m / l.radius_m, -1.0, 1.0);
        for (int k = 0; k < 3; ++k) pixel[k] = code(shade * l.colour[k]);
      }
    }
  }
  return image;
}

int poses() {
  const char* asked = std::getenv("TWOCONE_POSES");
  return asked != nullptr ? std::atoi(asked) : 24;
}

TEST(OneRay, EllipsesHoldTheTruthAndErrorsAreBelowThoseOfIndependentPixels) {
  // A row of pixels that shows an edge between two of them leaves it anywhere between these: 1/sqrt(12) px. A fit that
  // takes these errors as independent noise can be no better than the Cramer-Rao bound of that noise. Measured errors
  // are 0.13 of it; four times that is allowed.
  const double pixel_px = 1 / std::sqrt(12.0);
  constexpr double kMostOfBound = 0.5;
  const Rig rig = lab_rig();
  const auto landmarks = six_landmarks();
  const auto targets = targets_of(landmarks);
  const OutlineRanging ranging(rig, targets, kImage, kImage);
  std::vector<Eigen::Vector2d> places;
  for (const auto& p : landmarks) places.push_back(p.centre_m);
  std::mt19937_64 random(20261127);
  std::uniform_real_distribution<double> x(-0.9, 0.9);
  std::uniform_real_distribution<double> y(-0.5, 0.5);
  std::uniform_real_distribution<double> turn(-3.1, 3.1);
  int fixes = 0;
  int fixes_inside = 0;
  int sightings = 0;
  int sightings_inside = 0;
  double squares = 0;
  double bounds = 0;
  double own = 0;
  const int count = poses();
  for (int i = 0; i < count; ++i) {
    const localisation::Pose pose{x(random), y(random), turn(random)};
    const auto seen = seen_from(landmarks, {pose.x_m, pose.y_m}, pose.heading_rad);
    const auto measured = ranging.measure(one_ray_image(rig.lower, seen), one_ray_image(rig.upper, seen));
    std::vector<localisation::LandmarkMeasurement> measurements;
    std::vector<Eigen::Matrix2d> information;
    for (std::size_t k = 0; k < measured.size(); ++k) {
      const RangeMeasurement& m = measured[k];
      Eigen::Matrix2d both = Eigen::Matrix2d::Zero();
      for (const bool is_upper : {false, true}) {
        const MirrorView& view = is_upper ? rig.upper : rig.lower;
        const auto& sighting = is_upper ? m.upper_sighting : m.lower_sighting;
        if (const auto one = sighting_information(view, targets[k], seen[k].centre_m, pixel_px)) both += *one;
        const auto near = near_top_point(view, seen[k].centre_m, targets[k].radius_m, targets[k].top_m);
        const auto at = near ? view.project(*near) : std::nullopt;
        if (!sighting || !at) continue;
        const Eigen::Vector2d off = sighting->pixel_px - *at;
        ++sightings;
        if (off.dot(sighting->covariance_px2.inverse() * off) <= kChi2_2dof_95) ++sightings_inside;
      }
      information.push_back(both);
      if (m.range_m && m.covariance) measurements.push_back({places[k], m.range_m, m.bearing_rad, *m.covariance});
    }
    const auto fix = localisation::fix_by_least_squares(measurements);
    if (fix.verdict != localisation::FixVerdict::kOk) continue;
    ++fixes;
    const Eigen::Vector2d off = *fix.position_m - Eigen::Vector2d(pose.x_m, pose.y_m);
    const Eigen::Matrix2d covariance = fix.covariance->topLeftCorner<2, 2>();
    if (off.dot(covariance.inverse() * off) <= kChi2_2dof_95) ++fixes_inside;
    squares += off.squaredNorm();
    own += covariance.trace();
    const auto bound = localisation::pose_bound(pose, places, information);
    ASSERT_TRUE(bound);
    bounds += bound->topLeftCorner<2, 2>().trace();
  }
  const double share = 100.0 * fixes_inside / fixes;
  const double sightings_share = 100.0 * sightings_inside / sightings;
  const double of_bound = std::sqrt(squares / bounds);
  const double of_own = std::sqrt(squares / own);
  std::printf(
      "poses: %d, fixes: %d\nposition in its 95 %% ellipse: %.1f %%, sighting: %.1f %% of %d\n"
      "rmse: %.3f mm, %.2f of independent pixels' bound, %.2f of the stated sigma\n",
      count, fixes, share, sightings_share, sightings, 1e3 * std::sqrt(squares / fixes), of_bound, of_own);
  EXPECT_GE(fixes, 0.99 * count);
  EXPECT_LE(of_bound, kMostOfBound);
  // For 24 poses the ratio scatters by a sixth, and the shares by their own binomial deviations: three are allowed.
  EXPECT_NEAR(of_own, 1, count >= 2000 ? 0.1 : 0.5);
  const auto slack = [&](int n) { return count >= 2000 ? 0 : 300 * std::sqrt(0.95 * 0.05 / n); };
  EXPECT_GE(share, 93 - slack(fixes));
  EXPECT_LE(share, 97 + slack(fixes));
  EXPECT_GE(sightings_share, 92 - slack(sightings));
}

}  // namespace
}  // namespace twocone::vision
