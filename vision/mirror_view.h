// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <numbers>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace twocone::vision {

/// Lens distortion of a pinhole image: OpenCV's model, about `principal_px` in units of `focal_px`.
struct LensDistortion {
  std::vector<double> coefficients;                    ///< k1 k2 p1 p2 [k3 [k4 k5 k6]]: 4, 5 or 8 numbers
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();  ///< fx, fy, > 0
  Eigen::Vector2d principal_px = Eigen::Vector2d::Zero();

  friend bool operator==(const LensDistortion&, const LensDistortion&) = default;
};

/// A pixel and its derivative by the n arguments that it was computed from (2 x n).
template <int n>
struct PixelWithJacobian {
  Eigen::Vector2d pixel_px;
  Eigen::Matrix<double, 2, n> jacobian;
};

/// Maps the pinhole image to the lens's image, and back. With (x, y) = (p - principal) / focal and r^2 = x^2 + y^2:
///
///     x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),
///     y' = y (the same)                                                      + p1 (r^2 + 2 y^2) + 2 p2 x y.
///
/// Far from the middle such a polynomial folds the image over itself. There (determinant of its Jacobian not > 0, or
/// denominator not > 0) neither direction has an answer. Still farther out a model may unfold again: there distort()
/// answers, but undistort() may find the inner of the two points. A real lens is fitted where it has data, and is not
/// used that far out.
///
/// Error growth: both directions are accurate to a few roundings of a pixel's coordinate times the condition of the
/// Jacobian.
class Lens {
 public:
  /// @throws std::invalid_argument naming every field outside its domain
  explicit Lens(const LensDistortion& distortion);

  [[nodiscard]] std::optional<Eigen::Vector2d> distort(const Eigen::Vector2d& pinhole_px) const;
  /// As distort(), with the derivative by `pinhole_px`.
  [[nodiscard]] std::optional<PixelWithJacobian<2>> distort_with_jacobian(const Eigen::Vector2d& pinhole_px) const;
  /// Inverts distort() by Newton's method, in at most kSteps steps. Returns nothing where it does not converge, and for
  /// input that is not finite.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& pixel) const;

 private:
  struct Bent {
    Eigen::Vector2d at;
    Eigen::Matrix2d jacobian;
  };
  /// Distorts a point, in units of the focal length.
  [[nodiscard]] std::optional<Bent> bend(const Eigen::Vector2d& straight) const;

  static constexpr int kSteps = 30;
  std::array<double, 8> k_{};  ///< k1 k2 p1 p2 k3 k4 k5 k6
  Eigen::Array2d focal_px_;
  Eigen::Array2d principal_px_;
};

/// A cone above an upward-looking lens, with its tip down, on the lens's axis.
struct ConeMirror {
  double apex_rad = std::numbers::pi / 2;  ///< full angle at the tip, in (0, pi)
  double rim_radius_m = 0;                 ///< R, > 0
  double lens_to_tip_m = 0;                ///< d, > 0
};

/// Returns v = (d / R + cot(apex / 2)) r_m, the focal length of the mirror's image in pixels (equation 2 of
/// MirrorView).
double focal_length_px(const ConeMirror& cone, double rim_radius_px);

/// One mirror in one image. Mirror and camera are one unit on one axis; the unit may be offset from the body's axis and
/// tilted.
struct MirrorViewSettings {
  ConeMirror cone;
  double lens_height_m = 0;  ///< lens above the floor
  Eigen::Vector2d centre_px =
      Eigen::Vector2d::Zero();  ///< the tip's column and row; pixel (0, 0) is the first one's centre
  double rim_radius_px = 0;     ///< r_m, > 0
  double azimuth_rad = 0;       ///< bearing of the image's x axis in the body frame
  bool mirrored = false;        ///< the image angle decreases as the bearing grows
  /// The unit's rotation about the body's x and y axes, about its lens: its axis points along
  /// R_y(tilt.y) R_x(tilt.x) z. Each is below pi / 4 in magnitude.
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
  Eigen::Vector2d axis_offset_m = Eigen::Vector2d::Zero();  ///< the lens's x and y in the body frame
  /// `centre_px` and `rim_radius_px` are those of the image without distortion. Coefficients that are all 0 mean none.
  std::optional<LensDistortion> distortion{};
  /// The middle of the camera's image. A lens that is not known is assumed to bend the image about it: the tip is up to
  /// 20 px away. Nothing: about the tip.
  std::optional<Eigen::Vector2d> lens_axis_px{};
};

/// A half-line in the body frame.
struct Ray {
  Eigen::Vector3d origin_m;
  Eigen::Vector3d direction;  ///< unit length

  /// Returns whether it descends. A view with such a ray to the top of an upright thing looks down at it, and shows the
  /// far half of its rim.
  [[nodiscard]] bool looks_down() const { return direction.z() < 0; }
};

/// Whether the cone ends at its rim, as the real one does, or continues. The latter is for solvers, whose next step or
/// whose noisy pixel may lie a little outside.
enum class Rim { kEnds, kGoesOn };

/// Projection of points into a cone mirror's image, and back-projection.
///
/// Body frame: x forward, y left, z up, origin on the floor below the lens. In the half-plane through the axis at
/// azimuth phi let rho be the distance from the axis and z the height above the lens. Reflection in the cone's side
/// (half angle a = apex / 2) maps the lens to V = (-d sin 2a, d (1 - cos 2a)), so every point appears as if seen from
/// V:
///
///     h = v (sin 2a (z - V_z) - cos 2a (rho - V_rho)) / (cos 2a (z - V_z) + sin 2a (rho - V_rho)),
///     v = (d / R + cot a) r_m.
///
/// For a = 45 degrees these are h = v (z - d) / (rho + d) and equation 2 of Burbridge & Spacek 2006, v = (d / R + 1)
/// r_m. Bearing and image angle: phi = azimuth + atan2(row - centre_row, column - centre_column); the atan2 is negated
/// when mirrored.
///
/// These formulas hold in the *unit's frame*, which is the body's frame as it would be if the lens stood over the
/// body's origin and the unit were upright: p_B = L + R_y(tilt.y) R_x(tilt.x) (p_U - (0, 0, L_z)) with the
/// lens at L = (axis_offset, lens_height). They give the *undistorted image*, which the lens (Lens) maps to
/// the camera's image. project() and back_project() map between the body's frame and the camera's image;
/// image_radius_px(), bearing_rad() and offset_px() map between the unit's frame and the undistorted image. Without
/// tilt, offset and distortion the two are the same.
///
/// Error growth: a pixel error e changes the bearing by e / h, so the bearing is lost towards the horizon (h = 0, the
/// tip); h itself loses the digits that cancel in z - V_z, which is again at the horizon.
class MirrorView {
 public:
  /// @throws std::invalid_argument naming every field outside its domain
  explicit MirrorView(const MirrorViewSettings& settings);

  [[nodiscard]] const MirrorViewSettings& settings() const { return settings_; }

  /// Returns v in pixels (equation 2).
  [[nodiscard]] double focal_length_px() const { return focal_length_px_; }

  /// Returns the elevation over the horizon that the circle of that radius in the undistorted image shows, upright
  /// unit: pi / 2 - apex + atan(h / v).
  [[nodiscard]] double elevation_rad(double radius_px) const;

  /// Returns the radius h in the undistorted image of a point at `distance_m` >= 0 from the unit's axis and `height_m`
  /// above the *floor*, in the unit's frame. Returns nothing where the mirror does not show it: at or beyond the tip's
  /// ray (h <= 0) or, with Rim::kEnds, outside the rim (h > r_m).
  [[nodiscard]] std::optional<double> image_radius_px(double distance_m, double height_m, Rim rim = Rim::kEnds) const;

  /// Returns the pixel (column, row) that shows the body-frame point `p_BQ_m`. Returns nothing where image_radius_px
  /// gives nothing, on the axis itself (where no bearing exists), where the lens has no answer, and for input that is
  /// not finite.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_BQ_m) const;
  /// Returns the same pixel, up to rounding, with its derivative by `p_BQ_m` in px/m.
  [[nodiscard]] std::optional<PixelWithJacobian<3>> project_with_jacobian(const Eigen::Vector3d& p_BQ_m,
                                                                          Rim rim = Rim::kEnds) const;

  /// Returns the ray that the pixel sees, from the mirror's surface outwards, in the body frame. Returns nothing
  /// exactly at the tip, outside the rim (with Rim::kEnds), where the lens has no answer, and for input that is not
  /// finite.
  [[nodiscard]] std::optional<Ray> back_project(const Eigen::Vector2d& pixel, Rim rim = Rim::kEnds) const;

  /// Maps a pixel of the undistorted image to the camera's image, and back. The mirror has no influence on this. Lens
  /// states where there is no answer.
  [[nodiscard]] std::optional<Eigen::Vector2d> distort_px(const Eigen::Vector2d& undistorted_px) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort_px(const Eigen::Vector2d& pixel) const;

  /// Returns the position of the lens, or of the tip, in the body frame.
  [[nodiscard]] Eigen::Vector3d lens_m() const;
  [[nodiscard]] Eigen::Vector3d tip_m() const;
  /// Returns whether a lens distorts the image, that is, whether not all coefficients are 0.
  [[nodiscard]] bool has_distortion() const { return lens_.has_value(); }

  /// Returns the bearing in (-pi, pi], unit's frame, of an offset from the centre in the undistorted image.
  /// @param offset_px not zero
  [[nodiscard]] double bearing_rad(const Eigen::Vector2d& offset_px) const;

  /// Returns the offset from the centre, in the undistorted image, of the point at `bearing_rad` and `radius_px`: the
  /// inverse of bearing_rad().
  [[nodiscard]] Eigen::Vector2d offset_px(double bearing_rad, double radius_px) const;

 private:
  [[nodiscard]] Eigen::Vector3d to_unit(const Eigen::Vector3d& p_BQ_m) const;

  MirrorViewSettings settings_;
  std::optional<Lens> lens_;
  bool is_moved_;             ///< tilted or off the axis
  Eigen::Matrix3d rotation_;  ///< from unit directions to body directions: R_y(tilt.y) R_x(tilt.x)
  double sin_apex_;
  double cos_apex_;
  double tan_half_;
  double focal_length_px_;
  double cos_azimuth_;
  double sin_azimuth_;
};

enum class Side { kLower, kUpper };
/// Returns lower or upper.
std::string_view to_string(Side side);

/// Returns the part of a rig, or of another pair with the members `lower` and `upper`, that belongs to one side.
template <typename Parts>
auto& of_view(Parts& parts, Side side) {
  return side == Side::kLower ? parts.lower : parts.upper;
}

/// When the rows of a camera's image are exposed, relative to the stamp of the image.
struct ExposureTimes {
  double late_s = 0;     ///< how much later than the stamp the middle row is exposed
  double readout_s = 0;  ///< from the exposure of the first row to that of the last row: a rolling shutter

  friend bool operator==(const ExposureTimes&, const ExposureTimes&) = default;
};
/// Returns how much later than the middle row a row is exposed, as a share of the readout time: -1/2 to 1/2.
inline double readout_share(double row_px, int height_px) { return height_px > 1 ? row_px / (height_px - 1) - 0.5 : 0; }

/// The two mirrors of one robot, one above the other, on one axis except for their tilts and offsets, and the times at
/// which their cameras expose.
struct Rig {
  MirrorView lower;
  MirrorView upper;
  std::array<ExposureTimes, 2> exposures{};  ///< by Side

  /// Returns s, the height of the upper tip over the lower one, in metres.
  [[nodiscard]] double mirror_separation_m() const;
};

}  // namespace twocone::vision
