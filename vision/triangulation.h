// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/uncertain_rig.h"

namespace twocone::vision {

/// Below this many standard deviations a disparity gives no range: at the usual 99.9 % the range's upper limit would be
/// unbounded.
constexpr double kMinSigmas = 3;

/// A landmark's place from its sightings in one or both views.
struct Triangulation {
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m;                  ///< horizontal, from the body's origin to the landmark's axis
  std::optional<double> bearing_rad;              ///< in the body frame, (-pi, pi]
  std::optional<Eigen::Matrix2d> covariance;      ///< of (range m, bearing rad), wherever both are given
  std::optional<Eigen::Matrix2d> own_covariance;  ///< the part of `covariance` that the sightings' own noise causes
  BySharedErrors<2>
      by_shared;  ///< of measured minus true (range m, bearing rad): the other part is by_shared by_shared^T
  std::optional<double> top_m;  ///< of the landmark, over the floor: as given, or from both views
  /// Lower minus upper radius in the undistorted images, the upper scaled to the lower's focal length.
  std::optional<double> disparity_px;
  double chi_squared = 0;      ///< of the sightings' residuals at the answer
  int degrees_of_freedom = 0;  ///< 2 with both views and a known top, 1 without, 0 with one view
};

/// Computes a landmark's place by weighted least squares of both sightings. With a known height of the top, the
/// unknowns are (range, bearing): each view gives the range by itself, and the views are weighted by their covariances.
/// With an unknown height, they are (range, bearing, height), and the range is that of the disparity. With a known
/// height one sighting is enough: verdict kOneView.
///
/// Verdicts:
/// * kOk, kOneView: range, bearing and covariance are given.
/// * kNotSeen: no sighting, or one without a height.
/// * kBeyondLimit: the inverse range is below kMinSigmas of its sigma, so the range has no upper limit (with an unknown
///   height: the disparity is not significant), or the inverse range is not positive. Only the bearing is given.
/// * kInconsistent: the two views contradict each other: chi_squared is beyond the 1 - 1e-6 quantile, or one view
///   cannot show a landmark that the other shows. Only chi_squared, its degrees of freedom and the disparity are given.
/// * kImpossible: no place in the world gives these pixels: they are not finite, at a tip, or outside a rim by more
///   than kMinSigmas of the pixel's sigma, or the landmark would stand around a view's axis, or the known top is on the
///   wrong side of the ray (a ray that rises never meets a top below the mirror).
///
/// It takes any cone, tilt, offset and lens that MirrorView models. The iteration starts where the ray meets the known
/// height, or where the two rays meet in the vertical plane of their mean bearing. It is Gauss-Newton on whitened
/// pixels with MirrorView's analytic derivative, solved by QR. The unknowns are inverse range u = 1 / (range + d),
/// bearing and, if the height is unknown, the slope (top - tip of the lower mirror) u. Upright 90 degree views are
/// linear in u and slope, so two or three steps are enough however far the landmark is. No heap memory is allocated.
///
/// Error growth: sigma_range = (range + d)^2 sigma_disparity / (v s) for the disparity, and
/// (range + d)^2 sigma_h / (v (top - lens - d)) for one view. The covariance is of first order: it is correct while the
/// range's sigma is small against the range; near kMinSigmas the range is biased outwards by (sigma_u / u)^2 of itself.
/// @param lower,upper null where the view does not show the landmark @param radius_m > 0 @param top_m over the floor
/// @throws std::invalid_argument for a radius that is not > 0, a top that is not finite, or a covariance that is not
/// positive definite
Triangulation triangulate(const Rig& rig, const Sighting* lower, const Sighting* upper, double radius_m,
                          std::optional<double> top_m);

/// The doubt about when the two pixels of a landmark were exposed, while the body moves.
struct TimeDoubt {
  BodyTwist twist;
  const BySharedErrors<2>* late = nullptr;  ///< of how much later than believed (lower, upper), s
};

/// Likewise, with a rig and a landmark that are not known exactly. Their errors count in the weights of the views, in
/// chi-squared and in the covariance ("consider covariance": Schmidt 1966; Bierman 1977, ch. 8), as they are at the
/// answer, to first order.
/// @param landmark true minus believed numbers; no columns: known exactly
/// @param doubt nothing: the body stands, or the times are exact
Triangulation triangulate(const UncertainRig& rig, const BySharedErrors<kLandmarkNumbers>& landmark,
                          const Sighting* lower, const Sighting* upper, double radius_m, std::optional<double> top_m,
                          const std::optional<TimeDoubt>& doubt = {});

}  // namespace twocone::vision
