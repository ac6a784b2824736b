// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <stdexcept>

#include <opencv2/core.hpp>

#include "base/errors.h"
#include "vision/image_quality.h"

namespace twocone::vision::image_quality {

/// Checks an image and a region. @throws std::invalid_argument as image_quality.h states; `function` begins the message
inline void check(const char* function, const cv::Mat& rgb, const ImageRegion& region) {
  if (rgb.type() != CV_8UC3 || rgb.empty())
    throw base::InvalidArgument("{}: the image must be of type CV_8UC3 (r g b)", function);
  if (!(region.radius_px > 0) || !std::isfinite(region.radius_px) || !region.centre_px.allFinite() ||
      !(region.inner >= 0) || !(region.outer > region.inner) || !(region.outer <= 1)) {
    throw base::InvalidArgument(
        "{}: a ring from {} to {} of {} px about {}, {} px, must be finite, its radius > 0 and 0 <= inner < outer <= 1",
        function, region.inner, region.outer, region.radius_px, region.centre_px.x(), region.centre_px.y());
  }
}

/// Returns whether a square of half diagonal `margin_px` about that pixel lies within the ring.
inline bool is_within(const ImageRegion& region, double column, double row, double margin_px) {
  const double radius_px = std::hypot(column - region.centre_px.x(), row - region.centre_px.y());
  return radius_px - margin_px >= region.inner * region.radius_px &&
         radius_px + margin_px <= region.outer * region.radius_px;
}

}  // namespace twocone::vision::image_quality
