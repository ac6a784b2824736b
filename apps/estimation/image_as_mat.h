// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "hal/image.h"
#include "hal/result.h"

namespace twocone::estimation {

/// Returns a view of the pixels, without a copy: CV_8UC1 of a grey image, CV_8UC3 of any other. `image` must be kGrey8
/// or have three bytes per pixel, and it must outlive the view.
inline cv::Mat as_mat(const Image& image) {
  // cv::Mat has no read-only form. Its users treat it as const.
  return {image.height_px, image.width_px, image.format == PixelFormat::kGrey8 ? CV_8UC1 : CV_8UC3,
          const_cast<std::uint8_t*>(image.bytes.data())};
}

/// Returns a copy of pixels of CV_8UC3 r g b.
inline Image as_image(const cv::Mat& rgb) {
  Image image{rgb.cols, rgb.rows, PixelFormat::kRgb8, {}};
  image.bytes.resize(rgb.total() * rgb.elemSize());
  cv::Mat pixels = as_mat(image);
  rgb.copyTo(pixels);
  return image;
}

/// Returns the pixels of a camera's image as rgb, without a copy if they are rgb already. Otherwise `converted` owns
/// the pixels. Errors: kBadData for another size than `wanted`, a wrong number of bytes, damaged JPEG data.
Result<cv::Mat> as_rgb(const Image& image, cv::Size wanted, const char* view, Image& converted);

}  // namespace twocone::estimation
