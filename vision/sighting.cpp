// SPDX-License-Identifier: Apache-2.0
#include "vision/sighting.h"

#include <cmath>

namespace twocone::vision {

std::optional<Eigen::Vector3d> near_top_point(const MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m,
                                              double top_m) {
  const Eigen::Vector2d from_axis = p_BL_m - view.settings().axis_offset_m;
  const double distance_m = std::hypot(from_axis.x(), from_axis.y());
  if (!std::isfinite(distance_m) || !std::isfinite(top_m) || !(distance_m > radius_m)) return std::nullopt;
  const Eigen::Vector2d near_m = p_BL_m - from_axis * (radius_m / distance_m);
  return Eigen::Vector3d(near_m.x(), near_m.y(), top_m);
}

}  // namespace twocone::vision
