// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace twocone::testing_support {

/// What a camera sees beside its mirror.
enum class Surroundings { kBlack, kEvenGrey, kBrightRing, kChequer, kSplit };
inline constexpr int kSurroundings = 5;

/// Fills what lies outside of the circle. An image of a synthetic view is black there, and mixed with black on the rim.
/// kBrightRing: a white ring, 9 % of the radius wide, before a dark room. kSplit: brighter than the mirror on one side,
/// darker on the other.
inline void surround(cv::Mat& rgb, const Eigen::Vector2d& centre_px, double radius_px, Surroundings kind) {
  for (int row = 0; row < rgb.rows; ++row) {
    for (int column = 0; column < rgb.cols; ++column) {
      const double distance_px = std::hypot(column - centre_px.x(), row - centre_px.y());
      const double outside = std::clamp(distance_px - radius_px + 0.5, 0.0, 1.0);
      if (outside == 0) continue;
      double level = 0;
      switch (kind) {
        case Surroundings::kBlack:
          break;
        case Surroundings::kEvenGrey:
          level = 110;
          break;
        case Surroundings::kBrightRing: {
          const double beyond_ring = std::clamp(distance_px - 1.09 * radius_px + 0.5, 0.0, 1.0);
          level = 245 * (1 - beyond_ring) + 40 * beyond_ring;
          break;
        }
        case Surroundings::kChequer:
          level = (column / 37 + row / 29) % 2 == 0 ? 235 : 60;
          break;
        case Surroundings::kSplit:
          level = column + row / 3 < rgb.cols / 2 ? 250 : 45;
          break;
      }
      for (int k = 0; k < 3; ++k) {
        std::uint8_t& value = rgb.at<cv::Vec3b>(row, column)[k];
        value = static_cast<std::uint8_t>(std::min(255.0, value + outside * level + 0.5));
      }
    }
  }
}

/// Adds Gaussian noise to all channels.
inline void add_noise(cv::Mat& rgb, double sigma_grey_levels, std::mt19937_64& random) {
  if (!(sigma_grey_levels > 0)) return;
  std::normal_distribution<double> noise(0, sigma_grey_levels);
  std::for_each(rgb.datastart, rgb.dataend, [&](const std::uint8_t& value) {
    const_cast<std::uint8_t&>(value) = static_cast<std::uint8_t>(std::clamp(value + noise(random), 0.0, 255.0));
  });
}

}  // namespace twocone::testing_support
