// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/colour_table.h"

#include <cmath>

namespace twocone::vision {
namespace {

/// d linear / d code at the linear light `linear`.
double decode_slope(double linear) {
  if (linear <= 0.0031308) return 1 / (12.92 * 255);
  const double coded = 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return 2.4 / 1.055 * std::pow((coded + 0.055) / 1.055, 1.4) / 255;
}

}  // namespace

ColourTable::ColourTable(const std::vector<Eigen::Vector3d>& colours) : hues_(colours) {
  constexpr int kSteps = 1 << kBits;
  cv::Mat cells(kSteps * kSteps, kSteps, CV_8UC3);
  const auto middle = [](int step) { return static_cast<std::uint8_t>((step << kDropped) + (1 << kDropped) / 2); };
  for (int r = 0; r < kSteps; ++r) {
    for (int g = 0; g < kSteps; ++g) {
      for (int b = 0; b < kSteps; ++b) cells.at<cv::Vec3b>(r * kSteps + g, b) = {middle(r), middle(g), middle(b)};
    }
  }
  const cv::Mat labels = hues_.label(cells);
  labels_.assign(labels.datastart, labels.dataend);
  for (int step = 0; step <= kLinearSteps; ++step) {
    const double slope = decode_slope(double(step) / kLinearSteps);
    weight_of_linear_[std::size_t(step)] = static_cast<float>(1 / (slope * slope));
  }
}

}  // namespace twocone::vision
