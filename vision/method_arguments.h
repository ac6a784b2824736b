// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "base/errors.h"
#include "base/plane.h"

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
  throw base::InvalidArgument("{}: the {} image has {} x {} pixels of {} channels, wanted {} x {} of r g b", method,
                              view, image.cols, image.rows, image.channels(), size.width, size.height);
}

/// Returns the error message for a landmark's radius; empty if it is valid.
inline std::string bad_radius(const Landmark& landmark) {
  if (landmark.radius_m > 0 && std::isfinite(landmark.radius_m)) return {};
  return fmt::format(" radius of '{}' is {} m, must be > 0;", landmark.name, landmark.radius_m);
}

/// Returns the landmarks' colours in their order, as HueLabels and ColourTable take them.
inline std::vector<Eigen::Vector3d> colours_of(const std::vector<Landmark>& landmarks) {
  std::vector<Eigen::Vector3d> colours;
  colours.reserve(landmarks.size());
  for (const Landmark& landmark : landmarks) colours.emplace_back(landmark.colour.data());
  return colours;
}

}  // namespace twocone::vision
