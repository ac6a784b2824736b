// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace twocone::vision {

/// Interpolates between the centres of a grey image's pixels; nothing outside them.
template <typename Pixel>
std::optional<double> bilinear(const cv::Mat& grey, const Eigen::Vector2d& p) {
  if (!(p.x() >= 0 && p.y() >= 0 && p.x() < grey.cols - 1 && p.y() < grey.rows - 1)) return std::nullopt;
  const int column = static_cast<int>(p.x());
  const int row = static_cast<int>(p.y());
  const double fx = p.x() - column;
  const double fy = p.y() - row;
  const auto at = [&grey](int r, int c) { return double(grey.at<Pixel>(r, c)); };
  return (1 - fy) * ((1 - fx) * at(row, column) + fx * at(row, column + 1)) +
         fy * ((1 - fx) * at(row + 1, column) + fx * at(row + 1, column + 1));
}

}  // namespace twocone::vision
