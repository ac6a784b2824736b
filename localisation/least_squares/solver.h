// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "localisation/least_squares/problem.h"

namespace twocone::localisation::least_squares {

/// What QR leaves of whitened rows J d = e: |J d - e|^2 = |R d - q|^2 + rest. Columns x, y, heading; those past the
/// unknowns are zero.
struct Factor {
  Eigen::Matrix3d r = Eigen::Matrix3d::Zero();  ///< upper triangular
  Eigen::Vector3d q = Eigen::Vector3d::Zero();
  Eigen::Vector3d norm = Eigen::Vector3d::Zero();  ///< of J's columns
};

/// A place where the cost has no slope.
struct Minimum {
  State state{};
  double cost = 0;  ///< chi-squared
  Factor factor{};
  bool converged = false;
};

/// Chi-squared at a state; infinity where it is not a number.
double cost_at(const Problem& problem, const State& state);

/// Chi-squared and the factor of the rows at a state. Landmarks within `nearest` of it have no gradient, nor have those
/// on which it stands to rounding.
double linearise(const Problem& problem, const State& state, double nearest, Factor& factor);

/// Gauss-Newton with Levenberg's damping, which is none while steps succeed; then, where that does not end at rounding
/// or ends on a saddle, Newton's method with all second derivatives, so that a minimum which first order does not see,
/// or whose residuals bend it, is reached to rounding too. Ends when the step is below rounding, or when it no longer
/// shrinks and what it could win is below rounding; not converged after kMaxSteps of Newton's.
/// @param worth a chi-squared: where Gauss-Newton ends above it, that is all
Minimum minimise(const Problem& problem, const State& start, double worth = std::numeric_limits<double>::infinity());
constexpr int kMaxSteps = 60;

/// What makes the columns of R comparable: one factor for x and y, so that no answer depends on how the map is turned,
/// and one for the heading.
Eigen::Vector3d scale_of(const Factor& factor, int unknowns);

/// Whether a minimum may lie within `reach` of a place, or a few times as far: what the slope and all second
/// derivatives there say, or the first ones where the cell is small against the distance of each landmark only
/// (Cell::is_fine).
bool may_hold_minimum(const Problem& problem, const State& state, double reach, bool is_fine);

/// The singular values (falling) and directions of R with its columns scaled.
struct Directions {
  int unknowns = 0;
  Eigen::Vector3d singular = Eigen::Vector3d::Zero();
  Eigen::Matrix3d u = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d v = Eigen::Matrix3d::Zero();      ///< columns, of the scaled unknowns
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< unknown = scaled * scale
  /// How many stand out of what rounding leaves of them.
  [[nodiscard]] int rank() const;
};
Directions directions(const Factor& factor, int unknowns);

/// Half of chi-squared's second derivative along a direction at a minimum, with all that first order leaves out.
double bend_along(const Problem& problem, const Minimum& minimum, const Eigen::Vector3d& direction);

/// Gauss-Newton across the least seen direction: a state that the others agree on, with the given one along it.
Minimum minimise_across(const Problem& problem, const State& start);

/// `state` moved by a step; the heading stays in (-pi, pi].
State moved(const State& state, const Eigen::Vector3d& step);
/// The step from `a` to `b`, the heading by the short way.
Eigen::Vector3d step_between(const State& a, const State& b);

/// What each landmark's numbers differ from the others' forecast of them, as chi-squared: of one that the minimum rests
/// on, leave-one-out; of one that it does not, as it is.
/// @param problem holds the landmarks; the minimum may be that of some of them only
/// @param is_out one each, 1 where the minimum does not rest on it; null where it rests on all
/// @param statistics room for one each, or null @returns the largest
double forecast(const Problem& problem, const Minimum& minimum, const char* is_out, double* statistics);

/// Chi-squared of one landmark at a state.
double whitened_error2(const Problem& problem, const Landmark& landmark, const State& state);

}  // namespace twocone::localisation::least_squares
