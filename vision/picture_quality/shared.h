// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <opencv2/core.hpp>

#include "vision/picture_quality.h"

namespace twocone::vision::picture_quality {

/// Linear light of each code.
const std::array<float, 256>& light_of_code();
/// The sRGB code, 0 to 255 and not rounded, of linear light.
double code_of(double light);
/// Linear light per grey level at a code, 0 to 255.
double light_per_grey(double code);

/// @throws std::invalid_argument as picture_quality.h tells; `who` begins the message
void check(const char* who, const cv::Mat& rgb, const PictureRegion& region);

/// Whether a square of half diagonal `margin_px` about that place lies within the ring.
bool is_within(const PictureRegion& region, double column, double row, double margin_px);

}  // namespace twocone::vision::picture_quality
