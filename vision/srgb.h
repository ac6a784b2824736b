// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <opencv2/core.hpp>

namespace twocone::vision {

/// Returns the linear light, 0 to 1, of an sRGB code, 0 to 255, which need not be an integer (IEC 61966-2-1).
double srgb_to_linear(double code);
/// Returns the code, not rounded, of linear light: the inverse.
double linear_to_srgb(double light);
/// Returns the linear light per step of the code, at a code.
double light_per_grey(double code);
/// Returns srgb_to_linear() of each integer code.
const std::array<float, 256>& light_of_code();
/// Returns the brightness in linear light, the mean of r, g and b. @param rgb CV_8UC3, sRGB-coded
cv::Mat_<float> linear_grey(const cv::Mat& rgb);

}  // namespace twocone::vision
