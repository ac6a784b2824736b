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
/// its covariance), solved by Householder's QR, never by the normal equations; ranks are judged with the columns scaled
/// to norm
/// 1. Coordinates are relative to the landmarks' middle, in a unit near the problem's size, so neither a far origin nor
/// 1e150 m cost digits. Converged when the step is below rounding; a residual that is zero already is converged. Up to
/// 32 landmarks take no heap.
///
/// * Needs: two ranges (then two answers, or one in between), or two landmarks with range and bearing, or three
/// bearings,
///   or one range and two bearings; fewer: kTooFew. Ranges alone give a position without heading (Fix::heading_rad
///   empty; the covariance's heading row and column zero).
/// * kAmbiguous: two positions explain the measurements (ranges to landmarks in line, two distinct places), the better
/// one
///   by less than 2 ln 1e6 in chi-squared: both, each with its covariance, the better first. Bearings decide where they
///   can.
/// * kWeak: one direction is not seen to first order: the scaled Jacobian's last singular value is what rounding leaves
/// (T3),
///   or chi-squared three sigmas out along that direction is not the 9 that it promises, or two answers have no ridge
///   of 9 between them. The position is the minimum across that direction; between two answers, on the middle along it.
/// * Outliers: where chi-squared of the fit, or of one landmark against the others' forecast of it, is what noise makes
/// less
///   often than 1e-4, subsets are tried (each landmark left out, then each pair, while fewer are left out than kept and
///   degrees of freedom remain), and the smallest set whose removal explains the rest is named; if two such sets tell
///   different places, or none explains: kContradictory, unless chi-squared is at most 9 times its degrees of freedom
///   (3 or more): then all are taken, as sigmas that are too small. Of more than 32 landmarks the 32 least expected are
///   suspects. An error that the other measurements do not forecast well enough to show cannot be found:
///   tests/localisation/least_squares_statistics_test.cpp counts such rooms.
/// * A measurement with a number that is negative (range), not finite, or a covariance that is not positive definite is
/// no
///   measurement: left out and counted in Fix::unusable. So is one without any number, and one whose sigma is 1e8 times
///   the problem's size or more. Range 0 is data. A landmark nearer than the position is known has no gradient (T16):
///   the covariance is that of the others.
/// * No range is taken to be better known than the doubles that hold it and the landmarks' coordinates.
/// * Landmarks at one place count as one. All of them at one place: kTooFew. So is a covariance too large for a double.
///
/// * Where chi-squared is beyond its 95 % quantile (3 degrees of freedom or more), the covariance is multiplied by
///   chi-squared over its degrees of freedom (Birge's ratio, Fix::widening).
///
/// Error growth: condition of the whitened, scaled Jacobian times epsilon times the largest length
/// (least_squares_exact_test.cpp, against 50 digits). The covariance is (J^T W J)^-1 at the answer; its first-order
/// validity ends where sigma reaches the curvature's radius, the range itself.
Fix fix_by_least_squares(std::span<const LandmarkMeasurement> measurements);

/// The Cramer-Rao bound of (x, y, heading) at a pose: the inverse of the sum of J_i^T I_i J_i, where I_i is the
/// information (inverse covariance) of (range, bearing) of landmark i, which may be singular. Nothing where the sum is,
/// to rounding, or is not finite. A landmark on which the pose stands has no gradient and adds nothing.
/// @throws std::invalid_argument where the two spans differ in length
std::optional<Eigen::Matrix3d> pose_bound(const Pose& pose, std::span<const Eigen::Vector2d> landmarks_m,
                                          std::span<const Eigen::Matrix2d> information);

}  // namespace twocone::localisation
