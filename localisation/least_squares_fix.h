// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/odometry.h"

namespace twocone::localisation {

/// Computes position and heading as the maximum likelihood of all ranges and bearings (Gaussian): method `outline`.
///
/// It uses closed-form starts (least_squares/starts.h: rigid alignment, squared ranges with both mirror answers, linear
/// resection), then Gauss-Newton with step control. Its rows are whitened (each measurement by the inverse Cholesky
/// factor of its covariance) and solved by Householder's QR, never by the normal equations. Newton's method with all
/// second derivatives follows where first order does not converge to rounding. Ranks are decided with one scale for x
/// and y and one for the heading, so no answer depends on the orientation of the map. Coordinates are relative to the
/// landmarks' middle, in a unit near the problem's size, so a far origin or 1e150 m costs no digits. Up to 32 landmarks
/// with range and bearing each need no heap.
///
/// Where two landmarks with range and bearing do not determine the minimum, and there is a range and a bearing, all
/// places where chi-squared may be low enough are searched by branch and bound (least_squares/starts.h). So each local
/// minimum within kRival = 27 of the lowest is found: tests/localisation/fix_rivals_test.cpp compares with an
/// exhaustive search. Where the search cannot be completed (sigmas that differ by many orders of magnitude), there is
/// no answer: kTooFew. Such a set costs 11 to 18 times as much as a determined one of six landmarks; one range with two
/// bearings, whose circle and arc may touch, costs up to some 700 times as much (FixOfMixed compared with
/// FixByLeastSquares/6 in bench/localisation_bench).
///
/// * Needs: two ranges (then there are two answers, or one in between), or two landmarks with range and bearing, or
///   three bearings, or one range and two bearings; fewer: kTooFew. Ranges alone give a position without heading
///   (Fix::heading_rad empty; the covariance's heading row and column zero).
/// * kAmbiguous: a second local minimum has a chi-squared of at most 27 above the lowest. Both are given, each with its
///   covariance, the better first. Bearings decide where they can. With a third minimum, or where the second one has no
///   covariance to first order, two answers would not cover all possibilities: kTooFew.
/// * kWeak: one direction is not observed to first order: the scaled Jacobian's last singular value is at the level of
///   rounding (T3), or chi-squared three sigmas out along that direction is not the 9 of a parabola, or two minima have
///   no ridge of 9 between them. The position is the minimum; between two minima, it is the middle along that
///   direction. The covariance is of first order across that direction. Along it, the covariance is the mean square of
///   the likelihood on the floor of the valley, up to 16 widths away. This is no bound, because the valley may bend and
///   continue. Two circles that miss by no more than noise explains are such a case: the position is the middle of the
///   gap.
/// * Outliers: a search starts where noise would cause a chi-squared as large as that of the fit, or of one landmark
///   against the forecast of the others, with a probability below 1e-4. It finds the smallest set of landmarks without
///   which the others agree (least_squares/answer.h). With up to 8 landmarks each one or two are tried in turn; if that
///   fails, or with more landmarks, any number is found by consensus of samples in a fixed order, at a cost linear in
///   the landmarks, 17 to 30 times the fix without outliers (FixWithOutliers compared with FixByLeastSquares in
///   bench/localisation_bench, and fix_outliers_test). Fewer are left out than believed, and three or more are
///   believed: two against one cannot be decided. If two such sets give different positions, or no set makes the others
///   agree, the verdict is kContradictory. The exception is a chi-squared of at most 9 times its degrees of freedom (3
///   or more): then all are used, and the sigmas are taken as too small. An error cannot be found if the other
///   measurements do not forecast it accurately enough: tests/localisation/least_squares_statistics_test.cpp counts
///   such rooms. Fewer than half may be wrong; if more than half are wrong in agreement, the wrong ones are believed.
/// * A length 1e8 times the median length is left out beforehand, as an outlier, if the others give a fix that three
///   landmarks confirm and that contradicts that length.
/// * A measurement with a number that is negative (range) or not finite, or with a covariance that is not positive
///   definite, is invalid: it is left out and counted in Fix::unusable. So is a measurement without any number, and a
///   range whose sigma is 1e8 times the problem's size or more. A bearing whose sigma is pi / sqrt(3) rad or more,
///   which is the sigma of a uniform direction, is ignored. Range 0 is data. A landmark nearer than the sigma of the
///   position has no gradient (T16): the covariance is that of the others.
/// * No range is taken as more accurate than the doubles that hold it and the landmarks' coordinates.
/// * Landmarks at one place count as one. The verdict is kTooFew if all of them are at one place, or if the
///   covariance is too large for a double.
/// * Where chi-squared is beyond its 95 % quantile (3 degrees of freedom or more), the covariance is multiplied by
///   chi-squared over its degrees of freedom (Birge's ratio, Fix::widening).
///
/// Error growth: condition of the whitened, scaled Jacobian times epsilon times the largest length
/// (least_squares_exact_test.cpp, against 50 digits), also where residuals bend it. The covariance is (J^T W J)^-1 at
/// the answer; its first-order validity ends where sigma reaches the radius of curvature, which is the range itself.
Fix fix_by_least_squares(std::span<const LandmarkMeasurement> measurements);

/// Computes the Cramer-Rao bound of (x, y, heading) at a pose: the inverse of the sum of J_i^T I_i J_i. I_i is the
/// information (inverse covariance) of (range, bearing) of landmark i, which may be singular. Returns nothing where the
/// sum is singular, to rounding, or not finite. A landmark at the position of the pose has no gradient and adds
/// nothing.
/// @throws std::invalid_argument where the two spans differ in length
std::optional<Eigen::Matrix3d> pose_bound(const Pose& pose, std::span<const Eigen::Vector2d> landmarks_m,
                                          std::span<const Eigen::Matrix2d> information);

/// What one view, or one sensor, measures of a landmark.
struct InformedMeasurement {
  Eigen::Vector2d landmark_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< on (range m, bearing rad); may be singular
  BySharedErrors<2> by_shared{};                          ///< as in LandmarkMeasurement
  BySharedErrors<2> place_by_shared{};
};

/// Computes the bound of (x, y, heading) at a pose where measurements have shared errors (Bayesian: the shared errors
/// have the prior of variance 1, and the measurements may inform on them). Returns nothing where pose_bound() does, and
/// without shared errors the same.
std::optional<Eigen::Matrix3d> shared_pose_bound(const Pose& pose, std::span<const InformedMeasurement> measurements);

}  // namespace twocone::localisation
