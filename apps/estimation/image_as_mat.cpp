// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/image_as_mat.h"

#include <utility>

namespace twocone::estimation {

Result<cv::Mat> as_rgb(const Image& image, cv::Size wanted, const char* view, Image& converted) {
  if (image.width_px != wanted.width || image.height_px != wanted.height) {
    return Error(ErrorCode::kBadData, "the {} image has {} x {} pixels, the robot file says {} x {}", view,
                 image.width_px, image.height_px, wanted.width, wanted.height);
  }
  if (image.format == PixelFormat::kRgb8 && image.bytes.size() == 3 * std::size_t(wanted.area())) {
    return as_mat(image);
  }
  auto rgb = to_rgb8(image);
  if (!rgb) return with_name(view, rgb.error());
  converted = std::move(*rgb);
  return as_mat(converted);
}

}  // namespace twocone::estimation
