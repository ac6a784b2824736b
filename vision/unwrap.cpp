// SPDX-License-Identifier: Apache-2.0
#include "vision/unwrap.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "base/errors.h"

namespace twocone::vision {

cv::Mat unwrap(const cv::Mat& image, const MirrorView& view, int width_px) {
  if (width_px < 1) throw base::InvalidArgument("unwrap: width_px is {}, must be >= 1", width_px);
  if (image.empty()) throw std::invalid_argument("unwrap: the image is empty");
  const MirrorViewSettings& s = view.settings();
  const int height_px = static_cast<int>(std::ceil(s.rim_radius_px));
  cv::Mat columns(height_px, width_px, CV_32F);
  cv::Mat rows(height_px, width_px, CV_32F);
  const Eigen::Vector2d nowhere(-2, -2);  // outside the image even for bilinear neighbours: black
  for (int column = 0; column < width_px; ++column) {
    const double bearing_rad = std::numbers::pi - 2 * std::numbers::pi * (column + 0.5) / width_px;
    for (int row = 0; row < height_px; ++row) {
      const Eigen::Vector2d undistorted = s.centre_px + view.offset_px(bearing_rad, s.rim_radius_px - row - 0.5);
      const Eigen::Vector2d p = view.distort_px(undistorted).value_or(nowhere);
      columns.at<float>(row, column) = static_cast<float>(p.x());
      rows.at<float>(row, column) = static_cast<float>(p.y());
    }
  }
  cv::Mat unrolled;
  cv::remap(image, unrolled, columns, rows, cv::INTER_LINEAR);
  return unrolled;
}

}  // namespace twocone::vision
