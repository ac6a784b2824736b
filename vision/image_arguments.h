// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

namespace twocone::vision {

/// Returns the error message for the image sizes given to a method; empty if both sizes are valid.
inline std::string bad_sizes(cv::Size lower, cv::Size upper) {
  std::string bad;
  for (const auto& [view, size] : {std::pair{"lower", lower}, std::pair{"upper", upper}}) {
    if (size.width > 0 && size.height > 0) continue;
    bad += fmt::format(" the {} image's size is {} x {} px, both must be > 0;", view, size.width, size.height);
  }
  return bad;
}

/// @throws std::invalid_argument for an image of another type than CV_8UC3, or of another size
inline void check_image(std::string_view method, const char* view, const cv::Mat& image, cv::Size size) {
  if (image.type() == CV_8UC3 && image.size() == size) return;
  throw std::invalid_argument(fmt::format("{}: the {} image has {} x {} pixels of {} channels, wanted {} x {} of r g b",
                                          method, view, image.cols, image.rows, image.channels(), size.width,
                                          size.height));
}

}  // namespace twocone::vision
