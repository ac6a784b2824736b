// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

namespace twocone::vision {

/// What is wrong with the sizes that a method is made for; empty: nothing.
inline std::string bad_sizes(cv::Size lower, cv::Size upper) {
  std::string bad;
  for (const auto& [view, size] : {std::pair{"lower", lower}, std::pair{"upper", upper}}) {
    if (size.width > 0 && size.height > 0) continue;
    bad += fmt::format(" the {} picture's size is {} x {} px, both must be > 0;", view, size.width, size.height);
  }
  return bad;
}

/// @throws std::invalid_argument for a picture of another type than CV_8UC3, or of another size
inline void check_picture(std::string_view method, const char* view, const cv::Mat& picture, cv::Size size) {
  if (picture.type() == CV_8UC3 && picture.size() == size) return;
  throw std::invalid_argument(
      fmt::format("{}: the {} picture has {} x {} pixels of {} channels, wanted {} x {} of r g b", method, view,
                  picture.cols, picture.rows, picture.channels(), size.width, size.height));
}

}  // namespace twocone::vision
