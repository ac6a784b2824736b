// SPDX-License-Identifier: Apache-2.0
#include "vision/rings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace twocone::vision {

Rings::Rings(const Eigen::Vector2d& centre_px, double rim_radius_px, cv::Size image) {
  // Circle k extends to k + 1/2, and a pixel's corner is half a diagonal farther out.
  const int outermost = static_cast<int>(std::floor(rim_radius_px - 0.5 - std::numbers::sqrt2 / 2));
  if (outermost < 0) return;
  rings_.resize(static_cast<std::size_t>(outermost) + 1);
  std::vector<std::vector<std::pair<double, cv::Point>>> by_angle(rings_.size());
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const double dx = column - centre_px.x();
      const double dy = row - centre_px.y();
      const auto k = static_cast<std::size_t>(std::lround(std::hypot(dx, dy)));
      if (k >= rings_.size()) continue;
      const double angle = std::atan2(dy, dx);
      by_angle[k].emplace_back(angle < 0 ? angle + 2 * std::numbers::pi : angle, cv::Point(column, row));
    }
  }
  for (std::size_t k = 0; k < rings_.size(); ++k) {
    std::sort(by_angle[k].begin(), by_angle[k].end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [angle, pixel] : by_angle[k]) rings_[k].push_back(pixel);
  }
}

}  // namespace twocone::vision
