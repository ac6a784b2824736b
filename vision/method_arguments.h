// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "base/errors.h"
#include "base/plane.h"

namespace twocone::vision {

/// Checks the image sizes given to a method.
inline void check_sizes(base::Complaints& bad, cv::Size lower, cv::Size upper) {
  for (const auto& [view, size] : {std::pair{"lower", lower}, std::pair{"upper", upper}}) {
    bad.require(size.width > 0 && size.height > 0, "the {} image's size is {} x {} px, both must be > 0", view,
                size.width, size.height);
  }
}

/// Checks an image. @throws std::invalid_argument for another type than CV_8UC3, or another size
inline void check_image(std::string_view method, const char* view, const cv::Mat& image, cv::Size size) {
  if (image.type() == CV_8UC3 && image.size() == size) return;
  throw base::InvalidArgument("{}: the {} image has {} x {} pixels of {} channels, wanted {} x {} of r g b", method,
                              view, image.cols, image.rows, image.channels(), size.width, size.height);
}

inline void check_radius(base::Complaints& bad, const Landmark& landmark) {
  bad.require(base::is_positive(landmark.radius_m), "radius of '{}' is {} m, must be > 0", landmark.name,
              landmark.radius_m);
}

/// Returns the landmarks' colours in their order, as HueLabels and ColourTable take them, without the banded ones.
inline std::vector<Eigen::Vector3d> colours_of(const std::vector<Landmark>& landmarks) {
  std::vector<Eigen::Vector3d> colours;
  colours.reserve(landmarks.size());
  for (const Landmark& landmark : landmarks) {
    if (!landmark.bands) colours.emplace_back(landmark.colour.data());
  }
  return colours;
}

}  // namespace twocone::vision
