// SPDX-License-Identifier: Apache-2.0
// Compares synthetic images with independent results: lines whose share of a pixel is simple, projection, symmetry, and
// very many samples.
#include "tests/support/synthetic_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <ostream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace twocone::testing_support {
namespace {

using vision::MirrorView;
using vision::MirrorViewSettings;

// Share of a pixel's area, as the header states.
constexpr double kCoverage = 1.0 / 512;
// Sums of some ten floats of size 1.
constexpr double kFloat = 1e-5;

/// Returns the lab's upper mirror in a small image. The coordinates of the tip are not round.
MirrorViewSettings small_view() {
  return {.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
          .lens_height_m = 0.55,
          .centre_px = {159.7, 120.2},
          .rim_radius_px = 117.3};
}

MirrorViewSettings skewed_view() {
  MirrorViewSettings s = small_view();
  s.cone.apex_rad = 1.61;
  s.azimuth_rad = 0.7;
  s.mirrored = true;
  s.tilt_rad = {0.011, -0.007};
  s.axis_offset_m = {0.0013, -0.0021};
  return s;
}

const Eigen::Vector3d kRed(0.8, 0.03, 0.03);

/// Returns whether the ray of a place in the image hits the landmark, by a ray's quadratic equation. This answer is
/// independent and slow.
bool hits(const MirrorView& view, const SyntheticLandmark& landmark, const Eigen::Vector2d& pixel) {
  const auto ray = view.back_project(pixel);
  if (!ray) return false;
  const Eigen::Vector2d o = ray->origin_m.head<2>() - landmark.centre_m;
  const Eigen::Vector2d d = ray->direction.head<2>();
  const double a = d.squaredNorm();
  const double b = o.dot(d);
  const double c = o.squaredNorm() - landmark.radius_m * landmark.radius_m;
  const double root = b * b - a * c;
  if (root < 0) return false;
  const double entry = (-b - std::sqrt(root)) / a;
  return entry > 0 && ray->origin_m.z() + entry * ray->direction.z() <= landmark.top_m;
}

TEST(SyntheticView, AStraightEdgeCoversWhatGeometrySays) {
  // The strip's edge is a straight line from the tip outwards, at this angle to the image's x axis.
  const MirrorView view(small_view());
  const SyntheticView synthetic(view, {320, 240}, {.level = 0});
  for (const double angle_rad : {0.0, 0.3, 1.2, -2.2}) {
    constexpr double kDistance_m = 0.4;
    constexpr double kHalf_rad = 0.8;
    const SyntheticScene scene{{},
                               {{.bearing_rad = angle_rad - kHalf_rad,
                                 .distance_m = kDistance_m,
                                 .half_width_m = kDistance_m * std::tan(kHalf_rad),
                                 .colour = {1, 1, 1}}},
                               {}};
    const cv::Mat light = synthetic.light(scene);
    double worst = 0;
    int cut = 0;
    for (int row = 0; row < 240; ++row) {
      for (int column = 0; column < 320; ++column) {
        const Eigen::Vector2d p = Eigen::Vector2d(column, row) - view.settings().centre_px;
        const Eigen::Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
        // Test pixels near this edge, far from the other one, the tip and the rim.
        if (p.dot(along) < 10 || p.norm() > 115) continue;
        const double beside_px = along.x() * p.y() - along.y() * p.x();  // towards higher angles: off the strip
        if (std::abs(beside_px) > 3) continue;
        // The share of a unit square on one side of a line is a sum over its columns, each of which is exact.
        double share = 0;
        constexpr int kColumns = 200;
        for (int k = 0; k < kColumns; ++k) {
          const double x = (k + 0.5) / kColumns - 0.5;
          if (std::abs(along.x()) > std::abs(along.y())) {
            const double edge = (along.y() * x - beside_px) / along.x();  // covered where along.x y < ...
            share += along.x() > 0 ? std::clamp(edge + 0.5, 0.0, 1.0) : 1 - std::clamp(edge + 0.5, 0.0, 1.0);
          } else {
            const double edge = (along.x() * x + beside_px) / along.y();
            share += along.y() > 0 ? 1 - std::clamp(edge + 0.5, 0.0, 1.0) : std::clamp(edge + 0.5, 0.0, 1.0);
          }
        }
        share /= kColumns;
        cut += share > 0 && share < 1;
        worst = std::max(worst, std::abs(share - double(light.at<cv::Vec3f>(row, column)[0])));
      }
    }
    EXPECT_GT(cut, 80) << angle_rad << " rad";
    EXPECT_LE(worst, kCoverage / 4) << "of a pixel, edge at " << angle_rad << " rad";
  }
}

struct CoverageCase {
  const char* name;
  MirrorViewSettings view;
  SyntheticLandmark landmark;
  friend void PrintTo(const CoverageCase& c, std::ostream* out) { *out << c.name; }
};

class Coverage : public testing::TestWithParam<CoverageCase> {};

INSTANTIATE_TEST_SUITE_P(Landmarks, Coverage,
                         testing::Values(CoverageCase{"Near", small_view(), {{1.1, 0.52}, 0.15, 0.93, kRed}},
                                         CoverageCase{"Far", small_view(), {{-2.3, 1.71}, 0.15, 1.21, kRed}},
                                         CoverageCase{"Thin", small_view(), {{0.3, -1.9}, 0.013, 1.17, kRed}},
                                         CoverageCase{"Skewed", skewed_view(), {{-1.2, 0.43}, 0.12, 0.97, kRed}},
                                         CoverageCase{"BeyondTheRim", small_view(), {{0.6, 0.1}, 0.11, 2.3, kRed}}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(Coverage, IsThatOfManySamples) {
  const MirrorView view(GetParam().view);
  const SyntheticView synthetic(view, {320, 240});
  const cv::Mat share = synthetic.coverage({{GetParam().landmark}, {}, {}}, 0);
  // The samples are on a lattice, so the error of their mean is about the outline's length times 1/(n^2).
  constexpr int kSide = 64;
  double worst = 0;
  double sum = 0;
  int cut = 0;
  for (int row = 0; row < 240; ++row) {
    for (int column = 0; column < 320; ++column) {
      const Eigen::Vector2d p(column, row);
      const double h_px = (p - view.settings().centre_px).norm();
      if (h_px <= SyntheticView::kTipZone_px || h_px > view.settings().rim_radius_px - 2) continue;
      const double got = double(share.at<float>(row, column));
      // Nine samples in and round the pixel show where no outline is near.
      int few = 0;
      for (int k = 0; k < 9; ++k) {
        few += hits(view, GetParam().landmark, p + 0.67 * Eigen::Vector2d(k % 3 - 1, k / 3 - 1));
      }
      if (few == 9) {
        EXPECT_NEAR(got, 1, kFloat) << column << ", " << row;
        continue;
      }
      if (few == 0 && got == 0) continue;
      int hit = 0;
      for (int k = 0; k < kSide * kSide; ++k) {
        // The lattice is turned by the golden ratio.
        const double x = (k + 0.5) / (kSide * kSide) - 0.5;
        const double y = std::fmod(k * (std::numbers::phi - 1), 1.0) - 0.5;
        hit += hits(view, GetParam().landmark, p + Eigen::Vector2d(x, y));
      }
      const double wanted = double(hit) / (kSide * kSide);
      worst = std::max(worst, std::abs(got - wanted));
      sum += got - wanted;
      ++cut;
      EXPECT_NEAR(got, wanted, kCoverage) << column << ", " << row;
    }
  }
  EXPECT_GT(cut, 25);
  std::printf("%d pixels on the outline: coverage off by %.5f at most, by %.6f in the mean\n", cut, worst, sum / cut);
}

TEST(SyntheticView, TheTopEndsWhereProjectionSaysIt) {
  // This is a share of the pixel's area again, along an edge of three rows.
  constexpr double kWithin_px = 0.02;
  for (const double distance_m : {1.07, 1.37, 2.61}) {
    MirrorViewSettings settings = small_view();
    settings.centre_px = {158.9, 120};
    const MirrorView view(settings);
    const SyntheticLandmark landmark{{distance_m, 0}, 0.15, 0.97, kRed};
    const auto near = view.project({distance_m - landmark.radius_m, 0, landmark.top_m});
    ASSERT_TRUE(near);
    const cv::Mat share = SyntheticView(view, {320, 240}).coverage({{landmark}, {}, {}}, 0);
    // The row through the tip is covered up to the near point. The outline is curved there, so the row's edge is nearer
    // to the tip than the near point by the mean of y^2 / (2 radius) over the row.
    const auto end_at = [&](double across_m) {
      const double x = distance_m - std::sqrt(landmark.radius_m * landmark.radius_m - across_m * across_m);
      return *view.project({x, across_m, landmark.top_m});
    };
    double mean_end_px = 0;
    constexpr int kSteps = 200;
    for (int k = 0; k < kSteps; ++k) {
      const double want_y = (k + 0.5) / kSteps - 0.5;
      double low = -0.14;
      double high = 0.14;
      for (int i = 0; i < 50; ++i) {
        const double middle = (low + high) / 2;
        (end_at(middle).y() - 120 < want_y ? low : high) = middle;
      }
      mean_end_px += end_at(low).x() / kSteps;
    }
    const int from = static_cast<int>(near->x()) - 8;
    double covered_px = 0;
    for (int column = from; column < from + 16; ++column) covered_px += double(share.at<float>(120, column));
    EXPECT_NEAR(from - 0.5 + covered_px, mean_end_px, kWithin_px / 4) << distance_m << " m";
    EXPECT_NEAR(mean_end_px, near->x(), 0.2) << "the curvature is a small matter";
  }
}

TEST(SyntheticView, WhatIsSymmetricLooksSo) {
  MirrorViewSettings settings = small_view();
  settings.centre_px = {159.5, 119.5};
  const MirrorView view(settings);
  const SyntheticView synthetic(view, {320, 240}, {.level = 0.4, .swing = 0.3, .rise = 0.2});
  const cv::Mat light = synthetic.light(
      {{{{1.3, 0}, 0.14, 0.95, kRed}, {{-0.9, 0.7}, 0.1, 0.9, {0, 0.7, 0.1}}, {{-0.9, -0.7}, 0.1, 0.9, {0, 0.7, 0.1}}},
       {},
       {}});
  cv::Mat flipped;
  cv::flip(light, flipped, 0);
  EXPECT_LE(cv::norm(light, flipped, cv::NORM_INF), kFloat);
}

TEST(SyntheticView, TheNearerHidesTheFarther) {
  const MirrorView view(small_view());
  const SyntheticView synthetic(view, {320, 240});
  const SyntheticLandmark near{{0.9, 0.3}, 0.1, 1.2, kRed};
  const SyntheticLandmark far{{1.8, 0.6}, 0.1, 1.2, {0.03, 0.8, 0.03}};
  const SyntheticScene both{{far, near}, {}, {}};
  EXPECT_LE(cv::norm(synthetic.coverage(both, 0), cv::NORM_L1), 1.0) << "wholly behind but for the tip's pixels";
  const cv::Mat alone = synthetic.coverage({{near}, {}, {}}, 0);
  EXPECT_LE(cv::norm(synthetic.coverage(both, 1), alone, cv::NORM_INF), kCoverage)
      << "other cells, so not the same to the last digit";
  const SyntheticScene behind_mast{
      {near}, {{.bearing_rad = std::atan2(0.3, 0.9), .distance_m = 0.13, .half_width_m = 0.004}}, {}};
  // The mast's half angle is 0.031 rad, the landmark's 0.106: the ratio is the hidden share.
  const double seen = cv::sum(synthetic.coverage(behind_mast, 0))[0] / cv::sum(alone)[0];
  EXPECT_NEAR(seen, 1 - 0.004 / 0.13 / std::asin(0.1 / std::hypot(0.9, 0.3)), 0.02);
}

TEST(SyntheticView, SharesAddUpToTheWhole) {
  // Landmarks in front of a sky of their own colour cannot be seen, wherever the outlines cut pixels.
  const SyntheticView synthetic(MirrorView(skewed_view()), {320, 240}, {.level = 0.37});
  const Eigen::Vector3d grey = Eigen::Vector3d::Constant(0.37);
  SyntheticScene scene{{{{0.9, 0.3}, 0.1, 1.2, grey}, {{1.8, 0.7}, 0.1, 1.2, grey}}, {}, {}};
  scene.shading = {.ambient = 1, .diffuse = 0, .light_bearing_rad = 0, .top = 1};
  scene.strips.push_back({.bearing_rad = 0.4, .distance_m = 0.13, .half_width_m = 0.004, .colour = grey});
  EXPECT_LE(cv::norm(synthetic.light(scene), synthetic.light({}), cv::NORM_INF), kFloat);
}

TEST(SyntheticView, BrightnessGoesWithTheNormal) {
  const MirrorView view(small_view());
  const SyntheticView synthetic(view, {320, 240});
  const SyntheticShading shading{.ambient = 0.5, .diffuse = 0.4, .light_bearing_rad = std::numbers::pi - 0.9, .top = 1};
  const SyntheticLandmark landmark{{1.3, 0.2}, 0.2, 0.95, {1, 0.5, 0.25}};
  const SyntheticScene scene{{landmark}, {}, shading};
  const cv::Mat light = synthetic.light(scene);
  const cv::Mat share = synthetic.coverage(scene, 0);
  double darkest = 1;
  double brightest = 0;
  for (int row = 100; row < 160; ++row) {
    for (int column = 205; column < 235; ++column) {
      if (share.at<float>(row, column) < 1) continue;
      // The ray's point of entry follows from the quadratic equation.
      const auto ray = view.back_project({column, row});
      const Eigen::Vector2d o = ray->origin_m.head<2>() - landmark.centre_m;
      const Eigen::Vector2d d = ray->direction.head<2>();
      const double b = o.dot(d) / d.squaredNorm();
      const double c = (o.squaredNorm() - landmark.radius_m * landmark.radius_m) / d.squaredNorm();
      const Eigen::Vector2d normal = (o + (-b - std::sqrt(b * b - c)) * d) / landmark.radius_m;
      if (normal.dot(d.normalized()) > -0.5) continue;  // near the outline of a side a pixel spans many normals
      const double facing = std::cos(std::atan2(normal.y(), normal.x()) - shading.light_bearing_rad);
      const double wanted = shading.ambient + shading.diffuse * std::max(0.0, facing);
      // A pixel that is wholly inside, with an outline near, is the mean of its cells. The error of second order in the
      // curvature remains.
      EXPECT_NEAR(double(light.at<cv::Vec3f>(row, column)[0]), wanted, 0.01) << column << ", " << row;
      EXPECT_NEAR(double(light.at<cv::Vec3f>(row, column)[2]), wanted / 4, 0.01) << column << ", " << row;
      darkest = std::min(darkest, wanted);
      brightest = std::max(brightest, wanted);
    }
  }
  EXPECT_GT(brightest - darkest, 0.2) << "both sides were looked at";
}

TEST(SyntheticView, NoiseIsAsAskedAndTheSeedDecidesIt) {
  constexpr double kSigma = 2;
  constexpr int kPixels = 640 * 480;
  const MirrorView view(MirrorViewSettings{.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
                                           .lens_height_m = 0.55,
                                           .centre_px = {319.5, 239.5},
                                           .rim_radius_px = 1000});
  const SyntheticView synthetic(view, {640, 480}, {.level = 0.2140});  // code 127.5 or so
  std::mt19937_64 random(7);
  std::mt19937_64 same(7);
  const cv::Mat quiet = synthetic.image({}, {}, random);
  const cv::Mat noisy = synthetic.image({}, {.noise_grey_levels = kSigma}, random);
  EXPECT_EQ(cv::norm(noisy, synthetic.image({}, {.noise_grey_levels = kSigma}, same), cv::NORM_INF), 0);
  cv::Mat difference;
  cv::subtract(noisy, cv::Scalar::all(0), difference, cv::noArray(), CV_64F);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(difference, mean, deviation);
  const double code = 255 * (1.055 * std::pow(0.2140, 1 / 2.4) - 0.055);
  for (int c = 0; c < 3; ++c) {
    // Five sigmas of a mean and of a deviation of that many pixels; rounding adds a twelfth to the variance.
    EXPECT_NEAR(mean[c], code, 5 * kSigma / std::sqrt(kPixels));
    EXPECT_NEAR(deviation[c], std::sqrt(kSigma * kSigma + 1.0 / 12), 5 * kSigma / std::sqrt(2.0 * kPixels));
  }
}

TEST(SyntheticView, GainSaturates) {
  const SyntheticView synthetic(MirrorView(small_view()), {320, 240}, {.level = 0.55});
  std::mt19937_64 random(1);
  const cv::Mat image = synthetic.image({}, {.gain = 1.9}, random);
  EXPECT_EQ(image.at<cv::Vec3b>(60, 160), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(image.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0)) << "beyond the rim";
}

TEST(SyntheticView, LandmarksAreSeenFromWhereTheBodyStands) {
  const auto seen = seen_from({{{2.0, 1.0}, 0.1, 1.0, kRed}}, {1.5, 0.2}, 0.3);
  const Eigen::Vector2d back(1.5 + std::cos(0.3) * seen[0].centre_m.x() - std::sin(0.3) * seen[0].centre_m.y(),
                             0.2 + std::sin(0.3) * seen[0].centre_m.x() + std::cos(0.3) * seen[0].centre_m.y());
  EXPECT_NEAR((back - Eigen::Vector2d(2.0, 1.0)).norm(), 0, 1e-15);
}

TEST(SyntheticView, RefusesWhatItCannotShow) {
  const SyntheticView synthetic(MirrorView(small_view()), {320, 240});
  EXPECT_THROW((void)synthetic.light({{{{1, 0}, 0, 1, kRed}}, {}, {}}), std::invalid_argument) << "no radius";
  EXPECT_THROW((void)synthetic.light({{{{1, 0}, 0.1, 0.6, kRed}}, {}, {}}), std::invalid_argument) << "below the tip";
  EXPECT_THROW((void)synthetic.light({{{{0.1, 0}, 0.1, 1, kRed}}, {}, {}}), std::invalid_argument) << "over the mirror";
  EXPECT_THROW(SyntheticView(MirrorView(small_view()), {0, 240}), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::testing_support
