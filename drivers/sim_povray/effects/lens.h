// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "drivers/sim_povray/effects/light.h"

/// What a lens does to a picture that an ideal pinhole took. Each stage at its neutral value changes no value by more
/// than rounding.
namespace twocone::sim_povray {

/// A point seen through OpenCV's lens model, in units of the focal length from the picture's centre, x right, y down:
///   r^2 = x^2 + y^2,  s = 1 + k1 r^2 + k2 r^4 + k3 r^6
///   x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y
struct LensPoint {
  double x = 0;
  double y = 0;
};
/// @param k k1 k2 p1 p2 [k3]; empty: the point as it is
[[nodiscard]] LensPoint distort(const std::vector<double>& k, const LensPoint& ideal);
/// The ideal point that is seen at `seen`, to 1e-9 focal lengths; not a number where Newton's method finds none on the
/// near side of the fold (beyond which the model would show the picture a second time, inside out).
[[nodiscard]] LensPoint undistort(const std::vector<double>& k, const LensPoint& seen);

/// The picture through that lens: bilinear between the ideal picture's pixels, black where it has none.
/// @param focal_px > 0
[[nodiscard]] Light distorted(const Light& ideal, const std::vector<double>& k, double focal_px);

/// Each point spread evenly over a disc; beyond the picture's edge its last pixels go on. The disc's share in a pixel
/// is counted on a grid of 16 x 16, so a radius of up to half a pixel changes nothing.
[[nodiscard]] Light defocused(const Light& sharp, double radius_px);

/// Times 1 - vignetting (r / r_corner)^2, r from the picture's centre, r_corner to the corner pixel's centre.
void vignette(Light& light, double vignetting);

}  // namespace twocone::sim_povray
