// SPDX-License-Identifier: Apache-2.0
#include "vision/ranging.h"

#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace twocone::vision {

std::optional<Eigen::Vector3d> near_top_point(const MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m,
                                              double top_m) {
  const Eigen::Vector2d from_axis = p_BL_m - view.settings().axis_offset_m;
  const double distance_m = std::hypot(from_axis.x(), from_axis.y());
  if (!std::isfinite(distance_m) || !std::isfinite(top_m) || !(distance_m > radius_m)) return std::nullopt;
  const Eigen::Vector2d near_m = p_BL_m - from_axis * (radius_m / distance_m);
  return Eigen::Vector3d(near_m.x(), near_m.y(), top_m);
}

Eigen::Vector2d place_after(const Eigen::Vector2d& p_BL_m, const BodyTwist& twist, double time_s) {
  // The body moves forward and turns, so a fixed object moves backward and turns the other way.
  return Eigen::Rotation2Dd(-twist.turn_radps * time_s) * (p_BL_m - Eigen::Vector2d(twist.forward_mps * time_s, 0));
}

std::optional<Eigen::Vector2d> axis_at_height(const MirrorView& view, const Ray& ray, double radius_m, double top_m) {
  const double along_m = (top_m - ray.origin_m.z()) / ray.direction.z();
  if (!(along_m > 0) || !std::isfinite(along_m)) return std::nullopt;
  const Eigen::Vector2d near_m = (ray.origin_m + along_m * ray.direction).head<2>();
  const Eigen::Vector2d from_axis = near_m - view.settings().axis_offset_m;
  return Eigen::Vector2d(near_m + radius_m * from_axis.normalized());
}

Eigen::Vector2d pixel_at_frame(const MirrorView& view, const Eigen::Vector2d& later_px, const Landmark& landmark,
                               const BodyTwist& twist, double late_s) {
  constexpr double kFar_m = 100;
  if (late_s == 0) return later_px;
  const auto ray = view.back_project(later_px, Rim::kGoesOn);
  if (!ray) return later_px;
  double top_m = landmark.top_m;
  auto later_m = axis_at_height(view, *ray, landmark.radius_m, top_m);
  if (!later_m || later_m->norm() > kFar_m) {
    const double along_m = kFar_m / ray->direction.head<2>().norm();
    if (!std::isfinite(along_m)) return later_px;
    const Eigen::Vector3d far_m = ray->origin_m + along_m * ray->direction;
    later_m = far_m.head<2>() * (1 + landmark.radius_m / kFar_m);
    top_m = far_m.z();
  }
  const auto near_m = near_top_point(view, place_after(*later_m, twist, -late_s), landmark.radius_m, top_m);
  const auto shown = near_m ? view.project_with_jacobian(*near_m, Rim::kGoesOn) : std::nullopt;
  return shown ? shown->pixel_px : later_px;
}

std::string_view to_string(RangeVerdict verdict) {
  constexpr std::array<std::string_view, 12> kNames{"ok",           "not_seen",       "truncated",    "no_match",
                                                    "beyond_limit", "same_colour",    "one_view",     "occluded",
                                                    "saturated",    "two_candidates", "inconsistent", "impossible"};
  static_assert(std::size_t(RangeVerdict::kImpossible) + 1 == kNames.size());
  return kNames.at(std::size_t(verdict));
}

}  // namespace twocone::vision
