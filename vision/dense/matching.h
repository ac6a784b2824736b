// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace twocone::vision {

/// Panoramas of both views, with their seams (dense/panorama.h), CV_32F, of which every pixel's noise has a standard
/// deviation of 1; and where they show something.
struct PanoramaPair {
  cv::Mat lower, upper;
  cv::Mat lower_shown, upper_shown;
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
