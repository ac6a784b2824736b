// SPDX-License-Identifier: Apache-2.0
#include "vision/rim.h"

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace twocone::vision {
namespace {

std::uint8_t coded(double linear) {
  return std::uint8_t(
      std::lround(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055)));
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
      const std::uint8_t grey = coded(sum / (d.rays * d.rays));
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
      Drawing d;
      d.rays = rays;
      d.black_outside = black;
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
    Drawing d;
    d.rays = rays;
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
