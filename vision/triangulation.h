// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/sighting.h"

namespace twocone::vision {

/// Range of two upright 90 degree views from their radial disparity, as its inverse, which stays well-behaved out to
/// infinity: 1 / (range + d) = disparity / (v s) (Burbridge & Spacek 2006, equation 1, turned round).
struct InverseRange {
  RangeVerdict verdict = RangeVerdict::kBeyondLimit;
  double inverse_per_m = 0;        ///< 1 / (range + d), signed: noise may take it below zero
  double sigma_inverse_per_m = 0;  ///< sigma_disparity / (v s), exact at every range
  std::optional<double> range_m;   ///< > 0; only where the verdict is kOk
  std::optional<double> sigma_range_m;
};

struct DisparityGeometry {
  double focal_length_px = 0;      ///< v, > 0
  double mirror_separation_m = 0;  ///< s, > 0
  double lens_to_tip_m = 0;        ///< d, > 0
  double rim_radius_px = 0;        ///< r_m, > 0: no disparity passes it
};

/// kOk; kBeyondLimit where the disparity does not stand out of its own sigma (below kMinSigmas of it: zero, negative
/// noise, 1e-9 px); kImpossible where it passes the rim's radius, would give a range that is not > 0, or is not finite
/// (the inverse and its sigma are then 0 and tell nothing).
/// @throws std::invalid_argument naming the fields outside their domain; sigma_px must be > 0
InverseRange range_from_disparity(double disparity_px, double sigma_px, const DisparityGeometry& geometry);

/// Below so many standard deviations a disparity tells no range: a range's upper limit would be without bound at the
/// usual 99.9 %.
constexpr double kMinSigmas = 3;

/// A landmark's place from what one or both views show of it.
struct Triangulation {
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m;              ///< horizontal, from the body's origin to the landmark's axis
  std::optional<double> bearing_rad;          ///< in the body frame, (-pi, pi]
  std::optional<Eigen::Matrix2d> covariance;  ///< of (range m, bearing rad), wherever both are given
  std::optional<double> top_m;                ///< of the landmark, over the floor: as given, or found from both views
  /// Lower minus upper radius in the undistorted pictures, the upper scaled to the lower's focal length.
  std::optional<double> disparity_px;
  double chi_squared = 0;      ///< of the sightings about the answer
  int degrees_of_freedom = 0;  ///< 2 with both views and a known top, 1 without, 0 with one view
};

/// Weighted least squares of both sightings over (range, bearing) where the top's height is known (each view then tells
/// the range by itself, and they are weighed by their covariances), or over (range, bearing, height) where it is not
/// (then the range is that of the disparity). One sighting is enough with a known height: verdict kOneView.
///
/// Verdicts:
/// * kOk, kOneView: range, bearing and covariance are given.
/// * kNotSeen: no sighting, or one without a height.
/// * kBeyondLimit: the inverse range stays below kMinSigmas of its sigma, so the range has no upper limit (with an
/// unknown
///   height: the disparity does not stand out of its sigma), or it is not positive. The bearing alone is given.
/// * kInconsistent: the two views contradict each other: chi_squared beyond the 1 - 1e-6 quantile, or
///   one of them cannot show what the other shows. Only chi_squared, its degrees of freedom and the disparity are
///   given.
/// * kImpossible: no place in the world gives these pixels: not finite, at a tip, or outside a rim by more than
///   kMinSigmas of the pixel's sigma, or the landmark would stand around a view's axis, or the known top is on the
///   wrong side of the ray (a ray that rises never meets a top below the mirror).
///
/// Any cone, tilt, offset and lens that MirrorView knows. Start: where the ray meets the known height, or where the two
/// rays meet in the vertical plane of their mean bearing. Then Gauss-Newton on whitened pixels, solved by QR, with
/// MirrorView's analytic derivative, over inverse range u = 1 / (range + d), bearing and, with the height unknown, the
/// slope (top - tip of the lower mirror) u: upright 90 degree views are linear in u and slope, so it takes two or three
/// steps however far the landmark is. No heap allocation.
///
/// Error growth: sigma_range = (range + d)^2 sigma_disparity / (v s) for the disparity, and
/// (range + d)^2 sigma_h / (v (top - lens - d)) for one view. The covariance is that of first order: it is true while
/// the range's sigma is small against the range, and near kMinSigmas the range is biased outwards by (sigma_u / u)^2 of
/// itself.
/// @param lower,upper null where the view does not show it @param radius_m > 0 @param top_m over the floor
/// @throws std::invalid_argument for a radius that is not > 0, a top that is not finite, or a covariance that is not
/// positive definite
Triangulation triangulate(const Rig& rig, const Sighting* lower, const Sighting* upper, double radius_m,
                          std::optional<double> top_m);

}  // namespace twocone::vision
