// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "base/plane.h"
#include "vision/mirror_view.h"

/// Makes images of a room full of texture in a mirror, without POV-Ray, and knows the distance of everything in it.
namespace twocone::testing_support {

/// A room of upright walls with a floor and boxes in it. World frame, m.
struct TexturedRoom {
  Eigen::AlignedBox3d walls{Eigen::Vector3d(-2.4, -2.0, 0), Eigen::Vector3d(2.4, 2.0, 2.4)};
  std::vector<Eigen::AlignedBox3d> boxes{};
  double cell_m = 0.05;   ///< size of the texture's grains; they are smooth, on two scales
  double slat_m = 0;      ///< period of slats round all walls, in place of the grains; 0: none
  double contrast = 0.6;  ///< of the light's swing over its mean; 0: plain walls

  /// Returns the point that a ray meets first. @param ray from within the walls
  [[nodiscard]] Eigen::Vector3d met(const vision::Ray& ray) const;
  /// Returns the linear grey light of a point, 0 to 1.
  [[nodiscard]] double light(const Eigen::Vector3d& point) const;
};

struct RoomCamera {
  double gain = 1;
  double full_well_electrons = 10000, read_noise_electrons = 10;
};

/// Returns the ray in the world's frame, of a body at a pose.
vision::Ray in_world(const vision::Ray& ray, const Pose2& body);

/// Returns the image: CV_8UC3, sRGB-coded, four rays a pixel; black outside the mirror.
cv::Mat image_of(const TexturedRoom& room, const vision::MirrorView& view, cv::Size size, const Pose2& body,
                 const RoomCamera& camera, std::mt19937_64& random);

}  // namespace twocone::testing_support
