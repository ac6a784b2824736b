// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "vision/dense/matching.h"

namespace twocone::vision {

/// Disparities at full resolution, all CV_32F, a row for each azimuth (without seam).
struct RefinedDisparities {
  cv::Mat disparity_px;  ///< in slope steps
  cv::Mat sigma_px;      ///< by noise and by how well the fit explains the images; infinite without texture
  cv::Mat texture;       ///< gradient energy of the window over that of noise
  cv::Mat misfit;        ///< residual of the fit over that of noise
};

/// Corrects disparities by least squares in windows.
/// @param start_px CV_32F, without seam @param is_matched CV_8U, likewise: the pixels that count in windows
/// @param widths_px of a cell, in pixels of the upper image, by slope index (PanoramaView::widths_px)
RefinedDisparities refine(const PanoramaPair& pair, const cv::Mat& start_px, const cv::Mat& is_matched,
                          const std::vector<float>& widths_px, int rounds);

}  // namespace twocone::vision
