// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "base/plane.h"
#include "vision/mirror_view.h"

namespace twocone::vision {

/// The position of a landmark in one view: the pixel of the *near point* of its top, which is the point of the top's
/// rim nearest to the view's axis (near_top_point). It is measured from the whole outline, so it is sub-pixel and needs
/// no feature of its own in the image.
struct Sighting {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();  ///< column, row; pixel (0, 0) is the first one's centre
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();  ///< of column and row
  /// Standard deviation of the outline's position along its normal, for each pixel of its length: noise over contrast.
  /// Empty where no outline was fitted (Stage::kFound).
  std::optional<double> edge_noise_px{};
};

/// The position of a landmark's axis.
inline Eigen::Vector2d place_m(const Landmark& landmark) { return {landmark.x_m, landmark.y_m}; }

/// The landmark's axis in the body frame, if the view's ray meets the near point at the height of its top. Nothing
/// where the ray does not reach that height.
std::optional<Eigen::Vector2d> axis_at_height(const MirrorView& view, const Ray& ray, double radius_m, double top_m);

/// The near point in the body frame: p_BL - radius_m * outwards, where `outwards` is the horizontal unit vector from
/// the view's axis (MirrorViewSettings::axis_offset_m) to the landmark's, at height `top_m` over the floor. Nothing
/// where the view's axis lies within the landmark, and for input that is not finite.
std::optional<Eigen::Vector3d> near_top_point(const MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m,
                                              double top_m);

}  // namespace twocone::vision
