// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>

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

/// A landmark as a solid that rays meet, from the floor to its top.
struct Solid {
  Eigen::Vector2d p_BL_m;
  double radius_m;
  double top_m;

  /// The height at which the ray first meets the solid.
  [[nodiscard]] std::optional<double> hit_height_m(const Ray& ray) const {
    const Eigen::Vector2d o = ray.origin_m.head<2>() - p_BL_m;
    const Eigen::Vector2d d = ray.direction.head<2>();
    const double a = d.squaredNorm();
    const double b = o.dot(d);
    const double c = o.squaredNorm() - radius_m * radius_m;
    if (b * b < a * c) return std::nullopt;
    const double in = (-b - std::sqrt(b * b - a * c)) / a;
    const double out = (-b + std::sqrt(b * b - a * c)) / a;
    const auto height = [&](double t) { return ray.origin_m.z() + t * ray.direction.z(); };
    if (in > 0 && height(in) >= 0 && height(in) <= top_m) return height(in);
    if (in > 0 && height(in) > top_m && height(out) < top_m) return top_m;  // from above, on the flat top
    return std::nullopt;
  }
};

}  // namespace twocone::vision
