// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "vision/mirror_view.h"

namespace twocone::vision {

/// Returns the mirror's image unrolled. Columns are bearings from +pi (left) down to -pi (right), so left stays left.
/// Rows are image radii from the rim (top) to the tip (bottom), one pixel each. With 90 degree cones this is a
/// cylindrical panorama whose lowest row is the horizon. Bearings and radii are those of the unit's frame
/// (vision/mirror_view.h), undistorted. So a tilted mirror's horizon stays the lowest row, while the floor appears
/// tilted. The interpolation is bilinear.
/// @throws std::invalid_argument for a width below 1 or an empty image
cv::Mat unwrap(const cv::Mat& image, const MirrorView& view, int width_px);

}  // namespace twocone::vision
