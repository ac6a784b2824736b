// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "drivers/sim_povray/camera/light.h"

/// Applies the effects of a lens to the image of an ideal pinhole camera. Each stage at its neutral value changes no
/// value by more than rounding.
namespace twocone::sim_povray {

/// A point seen through OpenCV's lens model, in units of the focal length from the image's centre, x right, y down:
///   r^2 = x^2 + y^2,  s = 1 + k1 r^2 + k2 r^4 + k3 r^6
///   x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y
struct LensPoint {
  double x = 0;
  double y = 0;
};
/// @param k k1 k2 p1 p2 [k3]; empty: the point is returned unchanged
[[nodiscard]] LensPoint distort(const std::vector<double>& k, const LensPoint& ideal);
/// Returns the ideal point that is seen at `seen`, to 1e-9 focal lengths; not a number if Newton's method finds none on
/// the near side of the fold (beyond which the model would show the image a second time, inside out).
[[nodiscard]] LensPoint undistort(const std::vector<double>& k, const LensPoint& seen);

/// Returns the image through that lens: bilinear between the ideal image's pixels, black where the ideal image has
/// none.
/// @param focal_px > 0
[[nodiscard]] Light distorted(const Light& ideal, const std::vector<double>& k, double focal_px);

/// Spreads each point evenly over a disc; beyond the image's edge its last pixels are repeated. The disc's share in a
/// pixel is counted on a grid of 16 x 16, so a radius of up to half a pixel changes nothing.
[[nodiscard]] Light defocused(const Light& sharp, double radius_px);

/// Multiplies by 1 - vignetting (r / r_corner)^2, r from the image's centre, r_corner to the corner pixel's centre.
void vignette(Light& light, double vignetting);

}  // namespace twocone::sim_povray
