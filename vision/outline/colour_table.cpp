// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/colour_table.h"

namespace twocone::vision {

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
    const double slope = light_per_grey(linear_to_srgb(double(step) / kLinearSteps));
    weight_of_linear_[std::size_t(step)] = static_cast<float>(1 / (slope * slope));
  }
}

}  // namespace twocone::vision
