// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>

#include <Eigen/Core>

namespace twocone::vision {

/// A cone above an upward-looking lens, its tip down, on the lens's axis.
struct ConeMirror {
  double apex_rad = std::numbers::pi / 2;  ///< full angle at the tip, in (0, pi)
  double rim_radius_m = 0;                 ///< R, > 0
  double lens_to_tip_m = 0;                ///< d, > 0
};

/// One mirror in one image.
struct MirrorViewSettings {
  ConeMirror cone;
  double lens_height_m = 0;  ///< lens above the floor
  Eigen::Vector2d centre_px =
      Eigen::Vector2d::Zero();  ///< the tip's column and row; pixel (0, 0) is the first one's centre
  double rim_radius_px = 0;     ///< r_m, > 0
  double azimuth_rad = 0;       ///< bearing of the image's x axis in the body frame
  bool mirrored = false;        ///< the image turns against the bearing
};

/// A half-line in the body frame.
struct Ray {
  Eigen::Vector3d origin_m;
  Eigen::Vector3d direction;  ///< unit length
};

/// Where points of the world appear in a cone's image, and back.
///
/// Body frame: x forward, y left, z up, origin on the floor below the lens. In the half-plane through the axis at
/// azimuth phi let rho be the distance from the axis and z the height above the lens. Reflection in the cone's side
/// (half angle a = apex / 2) maps the lens to V = (-d sin 2a, d (1 - cos 2a)), so every point is seen as from V:
///
///     h = v (sin 2a (z - V_z) - cos 2a (rho - V_rho)) / (cos 2a (z - V_z) + sin 2a (rho - V_rho)),
///     v = (d / R + cot a) r_m.
///
/// For a = 45 degrees these are h = v (z - d) / (rho + d) and equation 2 of Burbridge & Spacek 2006, v = (d / R + 1)
/// r_m. Bearing and image angle: phi = azimuth + atan2(row - centre_row, column - centre_column), the atan2 negated
/// when mirrored.
///
/// Error growth: a pixel error e moves the bearing by e / h, so towards the horizon (h = 0, the tip) it is lost; h
/// itself loses the digits that z - V_z cancels, which is the horizon again.
class MirrorView {
 public:
  /// @throws std::invalid_argument naming every field outside its domain
  explicit MirrorView(const MirrorViewSettings& settings);

  [[nodiscard]] const MirrorViewSettings& settings() const { return settings_; }

  /// v in pixels (equation 2).
  [[nodiscard]] double focal_length_px() const { return focal_length_px_; }

  /// Radius h in the image of a point at `distance_m` >= 0 from the axis and `height_m` above the *floor*.
  /// Nothing where the mirror does not show it: at or beyond the tip's ray (h <= 0) or outside the rim (h > r_m).
  [[nodiscard]] std::optional<double> image_radius_px(double distance_m, double height_m) const;

  /// The pixel (column, row) that shows the body-frame point `p_BQ_m`. Nothing as in image_radius_px, on the axis
  /// itself, where no bearing exists, and for input that is not finite.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_BQ_m) const;

  /// The ray that the pixel sees, from the mirror's surface outwards. Nothing at the tip's very pixel, outside the rim,
  /// and for input that is not finite.
  [[nodiscard]] std::optional<Ray> back_project(const Eigen::Vector2d& pixel) const;

  /// Bearing in (-pi, pi] of an image offset from the centre. @param offset_px not zero
  [[nodiscard]] double bearing_rad(const Eigen::Vector2d& offset_px) const;

  /// Offset from the centre of the image point at `bearing_rad` and `radius_px`: the inverse of the above.
  [[nodiscard]] Eigen::Vector2d offset_px(double bearing_rad, double radius_px) const;

 private:
  MirrorViewSettings settings_;
  double sin_apex_;
  double cos_apex_;
  double tan_half_;
  double focal_length_px_;
};

/// The two mirrors of one robot, one above the other on one axis.
struct Rig {
  MirrorView lower;
  MirrorView upper;

  /// s: height of the upper tip over the lower one, metres.
  [[nodiscard]] double mirror_separation_m() const;
};

}  // namespace twocone::vision
