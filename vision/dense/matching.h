// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace twocone::vision {

/// How much less sharply across the upper view sees a point than the lower view: its pixel is nearer to the tip, where
/// a pixel spans more of the circle. The lower view is blurred across by levels, so that both can be compared.
class AcrossBlur {
 public:
  /// Standard deviations, in azimuths.
  static constexpr std::array<double, 5> kLevels{0, 0.7, 1.2, 2, 3.2};

  /// @param lower_px,upper_px PanoramaView::widths_px()
  AcrossBlur(const std::vector<float>& lower_px, const std::vector<float>& upper_px);

  /// Returns the level for a pixel of the lower view, of this slope index, whose match has that one.
  [[nodiscard]] int level(int lower, int upper) const { return levels_.at<std::uint8_t>(lower, upper); }
  /// Returns the panorama at all levels.
  [[nodiscard]] static std::vector<cv::Mat> blurred(const cv::Mat& panorama);

 private:
  cv::Mat levels_;  ///< CV_8U
};

/// The floor in the panoramas: its disparity falls linearly with the slope, to 0 at the horizon, often by a step for
/// each step of slope. Windows and paths that expect equal disparities would lose it.
struct FloorLine {
  double per_slope = 0;  ///< of the disparity by the slope index of the lower view, < 0; 0: no view shows the floor
  double horizon = 0;    ///< slope index of the lower view at which the disparity is 0

  /// Returns the disparity at a slope index of the lower view, in slope steps; negative over the horizon.
  [[nodiscard]] double disparity_px(double index) const { return per_slope * (index - horizon); }
  [[nodiscard]] bool is_shown() const { return per_slope < 0 && horizon > 0; }
};

/// Panoramas of both views, with their seams (dense/panorama.h), CV_32F, of which every pixel's noise has a standard
/// deviation of 1; and where they show something.
struct PanoramaPair {
  std::vector<cv::Mat> lower;  ///< by AcrossBlur::level()
  cv::Mat upper;
  cv::Mat lower_shown, upper_shown;
  const AcrossBlur* blur;
  const FloorLine* floor;
};

/// Disparities at half the resolution, a row for each second azimuth (without seam) and a column for each second slope.
struct MatchedDisparities {
  cv::Mat disparity_px;  ///< CV_32F, in slope steps of the full resolution
  cv::Mat is_unchecked;  ///< CV_8U, 255: the upper view's own match there is another one
  cv::Mat is_repeated;   ///< CV_8U, 255: another disparity matches as well
};

/// Semi-global matching of the lower view's pixels with those of the upper view at the same azimuth and a lower slope.
/// @param greatest_px of the disparities that are searched, in slope steps
MatchedDisparities match(const PanoramaPair& pair, int greatest_px);

}  // namespace twocone::vision
