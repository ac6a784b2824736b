// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/mirror_view.h"

namespace twocone::vision {

/// Size of the lab's images.
inline const cv::Size kImage(640, 480);

/// A view with the lab's mirror sizes (robots/lab_sim.yaml).
inline MirrorViewSettings lab_view(double lens_height_m) {
  return {.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
          .lens_height_m = lens_height_m,
          .centre_px = {319.5, 239.5},
          .rim_radius_px = 236};
}
inline Rig lab_rig() { return {MirrorView(lab_view(0.25)), MirrorView(lab_view(0.55))}; }

/// The point at a range and bearing in the body's frame.
inline Eigen::Vector2d place(double range_m, double bearing_rad) {
  return range_m * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
}

}  // namespace twocone::vision
