// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/overlay.h"

#include <cmath>

#include <Eigen/Geometry>

#include "localisation/odometry.h"
#include "vision/ranging.h"

namespace twocone::survey {
namespace {

// Landmarks of one hue that are nearer to each other than this are one.
constexpr double kSamePlace_m = 0.35;

}  // namespace

std::optional<std::size_t> same_landmark(const Landmark& landmark, const std::vector<Landmark>& among) {
  for (std::size_t i = 0; i < among.size(); ++i) {
    const bool is_near = (vision::place_m(among[i]) - vision::place_m(landmark)).norm() < kSamePlace_m;
    if (is_near && look_alike(among[i], landmark)) return i;
  }
  return std::nullopt;
}

Eigen::Vector2d Overlay::moved(const Eigen::Vector2d& place_m) const {
  return shift_m + Eigen::Rotation2Dd(heading_rad) * place_m;
}

Landmark Overlay::moved(Landmark landmark) const {
  const Eigen::Vector2d place_m = moved(vision::place_m(landmark));
  landmark.x_m = place_m.x();
  landmark.y_m = place_m.y();
  return landmark;
}

Eigen::Vector3d Overlay::moved(const Pose2& pose) const {
  const Eigen::Vector2d place_m = moved(Eigen::Vector2d(pose.x_m, pose.y_m));
  return {place_m.x(), place_m.y(), localisation::wrap_angle_rad(pose.heading_rad + heading_rad)};
}

Overlay best_overlay(const std::vector<Landmark>& landmarks, const std::vector<Landmark>& onto) {
  Overlay best;
  const auto is_pair = [](const Landmark& a, const Landmark& b) { return look_alike(a, b) && !a.name.empty(); };
  for (const Landmark& a : landmarks) {
    for (const Landmark& b : landmarks) {
      for (const Landmark& c : onto) {
        for (const Landmark& d : onto) {
          if (&a == &b || &c == &d || !is_pair(a, c) || !is_pair(b, d)) continue;
          const Eigen::Vector2d here_m = vision::place_m(b) - vision::place_m(a);
          const Eigen::Vector2d there_m = vision::place_m(d) - vision::place_m(c);
          if (std::abs(here_m.norm() - there_m.norm()) > kSamePlace_m) continue;
          Overlay overlay;
          overlay.heading_rad =
              localisation::wrap_angle_rad(std::atan2(there_m.y(), there_m.x()) - std::atan2(here_m.y(), here_m.x()));
          overlay.shift_m = (vision::place_m(c) + vision::place_m(d)) / 2 -
                            Eigen::Rotation2Dd(overlay.heading_rad) * (vision::place_m(a) + vision::place_m(b)) / 2;
          for (const Landmark& landmark : landmarks) {
            overlay.agree += !landmark.name.empty() && same_landmark(overlay.moved(landmark), onto) ? 1 : 0;
          }
          if (overlay.agree > best.agree) best = overlay;
        }
      }
    }
  }
  return best;
}

}  // namespace twocone::survey
