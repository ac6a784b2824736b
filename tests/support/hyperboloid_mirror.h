// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace twocone::vision {

/// The upper sheet of y^2 / a^2 - r^2 / b^2 = 1 above an upward-looking lens that stands in the lower focus. With
/// b^2 = c^2 - a^2 the foci are 2 c apart, and the mirror's lowest point is a + c above the lens.
struct HyperboloidMirrorSettings {
  double half_axis_m = 0;   ///< a, > 0
  double half_focal_m = 0;  ///< c, > a
  double rim_radius_m = 0;  ///< > 0
};

/// Projection by a hyperbolic mirror, and its inverse. The mirror has a single viewpoint, the upper focus F: the lens
/// sees a point by the ray that would have passed through F. Heights are over the lens.
///
/// In the direction of elevation e, the mirror is at the distance t = b^2 / (a - c sin e) from F. So a point in that
/// direction is reflected at P = F + t (cos e, sin e), and the lens sees it at the slope P_r / P_z, which is its image
/// radius over the focal length. Inverse: the lens's ray of slope s meets the mirror at height
/// z = b^2 (c + a sqrt(1 + s^2)) / (b^2 - a^2 s^2), and e is the elevation of (s z, z - 2 c). (Both are the polar form
/// of a conic about its foci: Baker & Nayar 1999.)
///
/// Error growth: in the middle of the image, straight down, a step of slope is (c + a) / (c - a) times a step of
/// elevation, and the image is coarsest; it gets finer outwards.
class HyperboloidMirror {
 public:
  /// @throws std::invalid_argument naming every field outside its domain
  explicit HyperboloidMirror(const HyperboloidMirrorSettings& settings);

  /// Returns the height of F over the lens: 2 c.
  [[nodiscard]] double viewpoint_m() const { return 2 * settings_.half_focal_m; }
  /// Returns the slope at which the lens sees the rim.
  [[nodiscard]] double rim_slope() const { return rim_slope_; }

  /// Returns the slope at which the lens sees a point at `distance_m` >= 0 from the axis. Returns nothing beyond the
  /// rim, behind the mirror's surface, and for input that is not finite.
  [[nodiscard]] std::optional<double> slope(double distance_m, double height_m) const;

  /// Returns the elevation, from F, of the ray that the lens sees at `slope`. Returns nothing outside 0 to rim_slope().
  [[nodiscard]] std::optional<double> elevation_rad(double slope) const;

 private:
  HyperboloidMirrorSettings settings_;
  double b2_m2_;
  double rim_slope_;
};

}  // namespace twocone::vision
