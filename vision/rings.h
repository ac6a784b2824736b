// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace twocone::vision {

/// The pixels of a mirror's image as whole-pixel circles round its tip: circle k holds the pixels whose distance from
/// the centre rounds to k. Every pixel is on exactly one circle.
class Rings {
 public:
  /// @param rim_radius_px > 0. Pixels beyond the image's edge are left out.
  Rings(const Eigen::Vector2d& centre_px, double rim_radius_px, cv::Size image);

  /// The largest circle whose pixels lie wholly inside the rim; below 0 if there is none.
  [[nodiscard]] int outermost() const { return static_cast<int>(rings_.size()) - 1; }

  /// Pixels of circle `k` in [0, outermost()], ordered by their angle in [0, 2 pi) from the image's x axis towards its
  /// y axis.
  [[nodiscard]] const std::vector<cv::Point>& ring(int k) const { return rings_.at(static_cast<std::size_t>(k)); }

 private:
  std::vector<std::vector<cv::Point>> rings_;
};

}  // namespace twocone::vision
