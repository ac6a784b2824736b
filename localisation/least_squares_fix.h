// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/odometry.h"

namespace twocone::localisation {

/// Method `full`: position and heading as the maximum of likelihood of all ranges and bearings (Gaussian).
///
/// Closed-form starts (least_squares/starts.h: rigid alignment, squared ranges with both mirror answers, linear
/// resection), then Gauss-Newton with step control on whitened rows (each measurement by the inverse Cholesky factor of
/// its covariance), solved by Householder's QR, never by the normal equations; then Newton's method with all second
/// derivatives where first order does not end at rounding. Ranks are judged with one scale for x and y and one for the
/// heading, so that no answer depends on how the map is turned. Coordinates are relative to the landmarks' middle, in a
/// unit near the problem's size, so neither a far origin nor 1e150 m cost digits. Up to 32 landmarks with range and
/// bearing each take no heap.
///
/// Where two landmarks with range and bearing do not settle which minimum it is, and there is a range and a bearing,
/// all places where chi-squared may be low enough are searched by branch and bound (least_squares/search.h), so that
/// each local minimum within kRival = 27 of the lowest is found: tests/localisation/fix_rivals_test.cpp, against a
/// search from everywhere. Where the search cannot be ended (sigmas that differ by many orders of magnitude), there is
/// no answer: kTooFew. Such a set costs 11 to 18 times a settled one of six landmarks, and one range with two bearings,
/// whose circle and arc may touch, up to some 700 times (FixOfMixed beside FixByLeastSquares/6 in
/// bench/localisation_bench).
///
/// * Needs: two ranges (then two answers, or one in between), or two landmarks with range and bearing, or three
///   bearings, or one range and two bearings; fewer: kTooFew. Ranges alone give a position without heading
///   (Fix::heading_rad empty; the covariance's heading row and column zero).
/// * kAmbiguous: a second local minimum has a chi-squared of at most 27 above the lowest: both, each with
///   its covariance, the better first. Bearings decide where they can. With a third one, or where the second one has no
///   covariance to first order, more is open than two answers say: kTooFew.
/// * kWeak: one direction is not seen to first order: the scaled Jacobian's last singular value is what rounding leaves
///   (T3), or chi-squared three sigmas out along that direction is not the 9 that it promises, or two minima have no
///   ridge of 9 between them. The position is the minimum; between two minima, on the middle along that direction. The
///   covariance is first order across it; along it, the mean square of the likelihood on the floor of the valley, up to
///   16 widths away. It is no bound along it: the valley may bend, and go on. Two circles that miss by no more than
///   noise makes them are such a case: the place is the middle of the gap.
/// * Outliers: where chi-squared of the fit, or of one landmark against the others' forecast of it, is what noise makes
///   less often than 1e-4, the smallest set of landmarks is looked for whose removal explains the rest
///   (least_squares/outliers.h): one or two of up to 8 in turn; else any number by consensus of samples in a fixed
///   order, at a cost linear in the landmarks, 17 to 30 times the fix without outliers (FixWithOutliers beside
///   FixByLeastSquares in bench/localisation_bench, and fix_outliers_test). Fewer are left out than
///   believed, and three or more are believed: two against one cannot be decided. If two such sets tell different
///   places, or none explains: kContradictory, unless chi-squared is at most 9 times its degrees of freedom (3 or
///   more): then all are taken, as sigmas that are too small. An error that the other measurements do not forecast well
///   enough to show cannot be found: tests/localisation/least_squares_statistics_test.cpp counts such rooms. Up to half
///   may be wrong; with more than that in agreement, the wrong ones are believed.
/// * A length 1e8 times the middle one of them is left out before, as an outlier, where the others give a fix
///   that three landmarks confirm and that does not expect it.
/// * A measurement with a number that is negative (range), not finite, or a covariance that is not positive definite
///   is no measurement: left out and counted in Fix::unusable. So is one without any number, and a range whose sigma is
///   1e8 times the problem's size or more. A bearing whose sigma is pi / sqrt(3) rad or more, that of any direction, is
///   none. Range 0 is data. A landmark nearer than the position is known has no gradient (T16): the covariance is that
///   of the others.
/// * No range is taken to be better known than the doubles that hold it and the landmarks' coordinates.
/// * Landmarks at one place count as one. All of them at one place: kTooFew. So is a covariance too large for a double.
///
/// * Where chi-squared is beyond its 95 % quantile (3 degrees of freedom or more), the covariance is multiplied by
///   chi-squared over its degrees of freedom (Birge's ratio, Fix::widening).
///
/// Error growth: condition of the whitened, scaled Jacobian times epsilon times the largest length
/// (least_squares_exact_test.cpp, against 50 digits), also where residuals bend it. The covariance is (J^T W J)^-1 at
/// the answer; its first-order validity ends where sigma reaches the curvature's radius, the range itself.
Fix fix_by_least_squares(std::span<const LandmarkMeasurement> measurements);

/// The Cramer-Rao bound of (x, y, heading) at a pose: the inverse of the sum of J_i^T I_i J_i, where I_i is the
/// information (inverse covariance) of (range, bearing) of landmark i, which may be singular. Nothing where the sum is,
/// to rounding, or is not finite. A landmark on which the pose stands has no gradient and adds nothing.
/// @throws std::invalid_argument where the two spans differ in length
std::optional<Eigen::Matrix3d> pose_bound(const Pose& pose, std::span<const Eigen::Vector2d> landmarks_m,
                                          std::span<const Eigen::Matrix2d> information);

}  // namespace twocone::localisation
