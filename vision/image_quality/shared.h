// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "vision/image_quality.h"

namespace twocone::vision::image_quality {

/// @throws std::invalid_argument as image_quality.h states; `function` begins the message
void check(const char* function, const cv::Mat& rgb, const ImageRegion& region);

/// Returns whether a square of half diagonal `margin_px` about that pixel lies within the ring.
bool is_within(const ImageRegion& region, double column, double row, double margin_px);

}  // namespace twocone::vision::image_quality
