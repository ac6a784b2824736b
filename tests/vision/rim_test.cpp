// SPDX-License-Identifier: Apache-2.0
#include "vision/rim.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/srgb.h"
#include "tests/vision/lab_rig.h"

namespace twocone::vision {
namespace {

// A soft edge that is drawn by coverage can be located to a fraction of a pixel; noise of a few grey levels against a
// step of 90 adds little.
constexpr double kSharp_px = 0.1;

/// A disc on a background with 4 grey levels of noise. Its edge pixels are shaded by the share that the edge cuts off.
cv::Mat disc(double column, double row, double radius_px, double inside, double outside) {
  cv::Mat image(480, 640, CV_8UC3);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 4);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      const double cover = std::clamp(radius_px - std::hypot(c - column, r - row) + 0.5, 0.0, 1.0);
      const double value = std::clamp(cover * inside + (1 - cover) * outside + noise(random), 0.0, 255.0);
      image.at<cv::Vec3b>(r, c) = cv::Vec3b::all(static_cast<std::uint8_t>(value));
    }
  }
  return image;
}

TEST(FindRim, FindsARimThatIsElsewhereThanExpected) {
  const auto rim = find_rim(disc(325.3, 233.1, 219.7, 90, 180), {{319.5, 239.5}, 236, 0});
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->centre_px.x(), 325.3, kSharp_px);
  EXPECT_NEAR(rim->centre_px.y(), 233.1, kSharp_px);
  EXPECT_NEAR(rim->radius_px, 219.7, kSharp_px);
  EXPECT_GT(rim->support, 0.9);
}

// Catches a rim that is compared with where it would be without the lens's distortion.
TEST(RimInImage, IsWhereABentImageShowsIt) {
  MirrorViewSettings settings = lab_view(0.25);
  settings.centre_px = {322.0, 246.5};
  settings.rim_radius_px = 212;
  settings.distortion = {.coefficients = {0.05, -0.02, 0, 0}, .focal_px = {600, 600}, .principal_px = {319.5, 239.5}};
  const MirrorView view(settings);
  cv::Mat image(480, 640, CV_8UC3);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      const double from_px = (*view.undistort_px({double(c), double(r)}) - settings.centre_px).norm();
      const double cover = std::clamp(settings.rim_radius_px - from_px + 0.5, 0.0, 1.0);
      image.at<cv::Vec3b>(r, c) = cv::Vec3b::all(static_cast<std::uint8_t>(180 - 90 * cover));
    }
  }
  const RimCircle expected = rim_in_image(view);
  EXPECT_GT(expected.radius_px - settings.rim_radius_px, 1);
  const auto rim = find_rim(image, expected);
  ASSERT_TRUE(rim);
  EXPECT_LT((rim->centre_px - expected.centre_px).norm(), kSharp_px);
  EXPECT_NEAR(rim->radius_px, expected.radius_px, kSharp_px);
}

TEST(FindRim, IsNotLedAstrayByOtherEdges) {
  cv::Mat image = disc(319.5, 239.5, 220, 90, 180);
  image(cv::Rect(470, 0, 40, 480)).setTo(cv::Scalar::all(255));  // a bright bar across a third of the rim's right side
  image(cv::Rect(120, 100, 20, 200)).setTo(cv::Scalar::all(0));
  const auto rim = find_rim(image, {{319.5, 239.5}, 225, 0});
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->radius_px, 220, kSharp_px);
}

// Catches taking the end of an image that holds little more than the mirror for the rim.
TEST(FindRim, IsNotLedAstrayByWhereTheImageEnds) {
  cv::Mat image = disc(319.5, 239.5, 220, 90, 110);
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      if (std::hypot(c - 319.5, r - 239.5) > 226) image.at<cv::Vec3b>(r, c) = cv::Vec3b::all(0);
    }
  }
  const auto rim = find_rim(image, {{319.5, 239.5}, 222, 0});
  ASSERT_TRUE(rim);
  // A step of 20 grey levels with a noise of 4: the edge of one direction is off by most of a pixel now and then.
  EXPECT_NEAR(rim->radius_px, 220, 5 * kSharp_px);
  // In front of black, the rim is where the black begins.
  const auto before_black = find_rim(disc(319.5, 239.5, 220, 90, 0), {{319.5, 239.5}, 222, 0});
  ASSERT_TRUE(before_black);
  EXPECT_NEAR(before_black->radius_px, 220, 5 * kSharp_px);
}

/// The image, black beyond a jagged edge with 53 teeth between `inner_px` and 8 px farther out.
cv::Mat jagged(cv::Mat image, double inner_px) {
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      const double turn = std::atan2(r - 239.5, c - 319.5) / (2 * std::numbers::pi) * 53;
      const double tooth = 2 * std::abs(turn - std::round(turn));
      if (std::hypot(c - 319.5, r - 239.5) > inner_px + 8 * tooth) image.at<cv::Vec3b>(r, c) = cv::Vec3b::all(0);
    }
  }
  return image;
}

// Catches taking the end of a simulated image (drivers/sim_povray/render/mirror_finder.h) for a rim that fog hides.
TEST(FindRim, TakesNoJaggedEdgeForARim) {
  const RimCircle expected{{319.5, 239.5}, 118, 0};
  const cv::Mat fog = jagged(disc(319.5, 239.5, 118, 128, 128), 124);
  EXPECT_FALSE(find_rim(fog, expected));
  EXPECT_FALSE(rim_may_show(fog, expected)) << "nothing but the image's end";
  for (const double outside : {110.0, 8.0}) {
    const cv::Mat room = jagged(disc(319.5, 239.5, 118, 128, outside), 124);
    EXPECT_TRUE(rim_may_show(room, expected));
    const auto rim = find_rim(room, expected);
    ASSERT_TRUE(rim) << outside;
    EXPECT_NEAR(rim->radius_px, 118, 5 * kSharp_px) << outside;
  }
  // Dark surroundings cannot be distinguished from pixels that were not rendered: the rim is where the dark begins.
  const auto dark = find_rim(jagged(disc(319.5, 239.5, 118, 128, 2), 124), expected);
  ASSERT_TRUE(dark);
  EXPECT_NEAR(dark->radius_px, 118, 5 * kSharp_px);
}

// The circle is like a fisheye's in the middle of an image.
TEST(FindRim, FindsACircleThatTheImageCutsOffAndThatIsBlackOutside) {
  const auto rim = find_rim(disc(319.5, 239.5, 239.5, 120, 0), {{319.5, 239.5}, 239, 0});
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->radius_px, 239.5, 5 * kSharp_px);
}

TEST(FindRim, FindsNothingWhereThereIsNothing) {
  EXPECT_FALSE(find_rim(disc(0, 0, 0, 128, 128), {{319.5, 239.5}, 200, 0}));
  EXPECT_FALSE(find_rim(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(7)), {{319.5, 239.5}, 200, 0}));
  EXPECT_FALSE(find_rim(disc(319.5, 239.5, 100, 90, 180), {{319.5, 239.5}, 200, 0})) << "far outside the search";
  EXPECT_FALSE(find_rim(disc(319.5, 239.5, 100, 90, 180), {{-900, 239.5}, 100, 0}))
      << "the search lies outside the image";
}

TEST(FindRim, RefusesWhatIsNoImageOrNoCircle) {
  EXPECT_THROW((void)find_rim(cv::Mat(10, 10, CV_8UC1), {{5, 5}, 3, 0}), std::invalid_argument);
  EXPECT_THROW((void)find_rim(cv::Mat(10, 10, CV_8UC3), {{5, 5}, 0, 0}), std::invalid_argument);
}

struct Drawing {
  Eigen::Vector2d tip{160.37, 118.81};
  double rim_px = 97.43;
  int rays = 1;  ///< number of rays along a pixel's side
  bool black_outside = false;
  double turn_rad = 0;
};

/// A mirror that shows sixteen upright stripes, darker than its surroundings, which end 6 px behind the rim.
cv::Mat draw(const Drawing& d) {
  cv::Mat rgb(240, 320, CV_8UC3);
  for (int row = 0; row < rgb.rows; ++row) {
    for (int column = 0; column < rgb.cols; ++column) {
      double sum = 0;
      for (int k = 0; k < d.rays * d.rays; ++k) {
        const Eigen::Vector2d p(column + (k % d.rays + 0.5) / d.rays - 0.5, row + (k / d.rays + 0.5) / d.rays - 0.5);
        const Eigen::Vector2d from = p - d.tip;
        const double angle = std::atan2(from.y(), from.x()) + d.turn_rad;
        const double mirror = 0.2 + (std::sin(8 * angle) + 0.3 * std::sin(3 * angle) > 0 ? 0.15 : 0);
        sum += from.norm() < d.rim_px ? mirror : d.black_outside && from.norm() > d.rim_px + 6 ? 0 : 0.7;
      }
      const auto grey = std::uint8_t(std::lround(testing_support::coded(sum / (d.rays * d.rays))));
      rgb.at<cv::Vec3b>(row, column) = {grey, grey, grey};
    }
  }
  return rgb;
}

std::vector<cv::Mat> turning(Drawing d, int count) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < count; ++i) {
    d.turn_rad = 0.0731 * i;
    images.push_back(draw(d));
  }
  return images;
}

TEST(RigCircles, RimIsFoundWithinItsSigmas) {
  for (const int rays : {1, 4}) {
    for (const bool black : {false, true}) {
      const Drawing d{.rays = rays, .black_outside = black};
      const auto images = turning(d, 9);
      const auto rim = measure_rim(median_image(images), {{162.5, 117}, 95, 0});
      ASSERT_TRUE(rim) << rays << black;
      EXPECT_NEAR(rim->centre_px.x(), d.tip.x(), 3 * rim->sigma_centre_px) << rays << black;
      EXPECT_NEAR(rim->centre_px.y(), d.tip.y(), 3 * rim->sigma_centre_px) << rays << black;
      EXPECT_NEAR(rim->radius_px, d.rim_px, 3 * rim->sigma_radius_px) << rays << black;
      EXPECT_LT(rim->sigma_centre_px, 0.1) << rays << black;
      EXPECT_GT(rim->support, 0.8) << rays << black;
    }
  }
}

TEST(RigCircles, NoRimInAnEvenImage) {
  EXPECT_FALSE(measure_rim(cv::Mat(240, 320, CV_8UC3, cv::Scalar(90, 90, 90)), {{160, 120}, 95, 0}));
}

TEST(RigCircles, TipIsWhereUprightEdgesMeet) {
  for (const int rays : {1, 4}) {
    const Drawing d{.rays = rays};
    const auto tip = measure_tip(turning(d, 9), {162.4, 117.1}, 30);
    ASSERT_TRUE(tip) << rays;
    EXPECT_NEAR(tip->centre_px.x(), d.tip.x(), 3 * tip->sigma_px) << rays;
    EXPECT_NEAR(tip->centre_px.y(), d.tip.y(), 3 * tip->sigma_px) << rays;
  }
  EXPECT_FALSE(measure_tip(std::vector<cv::Mat>{cv::Mat(240, 320, CV_8UC3, cv::Scalar(9, 9, 9))}, {160, 120}, 30));
}

TEST(RigCircles, MedianKeepsWhatStays) {
  std::vector<cv::Mat> images;
  for (const int grey : {10, 250, 40, 30, 0}) images.emplace_back(3, 4, CV_8UC3, cv::Scalar(grey, 7, 200 - grey / 2));
  EXPECT_EQ(median_image(images).at<cv::Vec3b>(2, 3), cv::Vec3b(30, 7, 185));
  EXPECT_THROW((void)median_image({}), std::invalid_argument);
  images.emplace_back(4, 4, CV_8UC3);
  EXPECT_THROW((void)median_image(images), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision
