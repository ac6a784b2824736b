// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "localisation/odometry.h"

namespace twocone::localisation {

/// The pose of a reference and its estimate at the same time.
struct PosePair {
  Pose reference;
  Pose estimate;
};

/// Errors of a trajectory, as evo defines them (Grupp 2017, metrics APE and RPE; Sturm et al. 2012), in the plane.
struct TrajectoryError {
  std::size_t count = 0;  ///< number of errors
  double rmse_m = 0;      ///< of the translation parts
  double mean_m = 0;
  double max_m = 0;
  double rmse_rad = 0;  ///< of the rotation angles, absolute
};

/// Computes the absolute error: the translation's norm and the angle of E_i = Q_i^-1 P_i, for reference Q and estimate
/// P. Returns nothing without pairs.
std::optional<TrajectoryError> absolute_error(std::span<const PosePair> pairs);

/// Computes the relative error over `delta` pairs: E_i = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), j = i + delta, for i = 0, delta,
/// 2 delta, ... This is evo's default, with segments that do not overlap. Returns nothing for fewer than delta + 1
/// pairs.
/// @param delta >= 1
/// @throws std::invalid_argument for 0
std::optional<TrajectoryError> relative_error(std::span<const PosePair> pairs, std::size_t delta);

/// Computes the relative error over `delta_m` of the reference's path. Each segment ends with the first pair at which
/// the reference has moved at least that far since the segment began, and the next begins there. Returns nothing where
/// no segment is complete.
/// @param delta_m > 0. @throws std::invalid_argument otherwise
std::optional<TrajectoryError> relative_error_over(std::span<const PosePair> pairs, double delta_m);

/// Returns the rotation and translation that bring the estimates' positions nearest to the reference's in the sense of
/// least squares (Umeyama 1991, without scale). Apply it to each estimate with `moved`. Returns nothing for fewer than
/// two pairs, or if all are at one place.
std::optional<Pose> alignment(std::span<const PosePair> pairs);

/// Returns frame * pose: `pose` is given in the coordinates of `frame`, the result in those in which `frame` is given.
Pose moved(const Pose& frame, const Pose& pose);

/// Returns frame^-1 * pose, the inverse of moved().
Pose seen_from(const Pose& frame, const Pose& pose);

/// Returns the ends of the segments of relative_error_over: pair 0, and each at which the reference has moved by
/// `delta_m` or more since the one before. @param delta_m > 0. @throws std::invalid_argument otherwise
std::vector<std::size_t> stretches(std::span<const PosePair> pairs, double delta_m);

}  // namespace twocone::localisation
