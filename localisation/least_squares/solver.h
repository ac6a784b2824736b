// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "localisation/least_squares/problem.h"

namespace twocone::localisation::least_squares {

/// The QR factor of whitened rows J d = e: |J d - e|^2 = |R d - q|^2 + rest. Columns are x, y, heading; columns beyond
/// the unknowns are zero.
struct Factor {
  Eigen::Matrix3d r = Eigen::Matrix3d::Zero();  ///< upper triangular
  Eigen::Vector3d q = Eigen::Vector3d::Zero();
  Eigen::Vector3d norm = Eigen::Vector3d::Zero();  ///< of J's columns
};

/// A state with its cost and the factor of its rows; a stationary point of the cost where `converged`.
struct Minimum {
  State state{};
  double cost = 0;  ///< chi-squared
  Factor factor{};
  bool converged = false;
};

/// Returns chi-squared at a state; infinity where it is not a number.
double cost_at(const Problem& problem, const State& state);

/// Computes chi-squared and the factor of the rows at a state. Landmarks within `nearest` of it, or at its place to
/// rounding, have no gradient.
Minimum linearise(const Problem& problem, const State& state, double nearest);

/// Finds a minimum by Gauss-Newton with Levenberg's damping, which is zero while steps succeed. Where that does not
/// converge to rounding or ends on a saddle, Newton's method with all second derivatives follows. It also reaches, to
/// rounding, a minimum that first order does not see or that is bent by its residuals. The iteration ends when the step
/// is below rounding, or when the step no longer shrinks and its gain is below rounding; it has not converged after
/// kMaxSteps of Newton's method.
/// @param worth a chi-squared: where Gauss-Newton ends above it, Newton's method is not tried
Minimum minimise(const Problem& problem, const State& start, double worth = std::numeric_limits<double>::infinity());
constexpr int kMaxSteps = 60;

/// The error of an estimated (x, y, heading), by its sources.
struct Estimate {
  Eigen::Matrix3d own_covariance;  ///< caused by the numbers' own noise
  BySharedErrors<3> by_shared;     ///< caused by the shared errors
};
/// Computes them at a state. Requires Problem::shared. @param nearest as for linearise()
Estimate estimate_at(const Problem& problem, const State& state, double nearest);

/// All numbers of a problem as one measurement near a state: error = slopes (true state - state) + own noise +
/// by_shared times the shared errors. Unused rows have zero slopes and unit noise.
struct LinearMeasurement {
  Eigen::Matrix3d slopes = Eigen::Matrix3d::Zero();
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  Eigen::Matrix3d own_covariance = Eigen::Matrix3d::Identity();
  BySharedErrors<3> by_shared{};
};
LinearMeasurement linear_measurement(const Problem& problem, const State& state);

/// Returns factors that make the columns of R comparable: a common one for x and y, because no answer may depend on the
/// orientation of the map, and one for the heading.
Eigen::Vector3d scale_of(const Factor& factor, int unknowns);

/// Returns whether a minimum may be within `reach` of a place, or a few times as far. The decision uses the slope and
/// all second derivatives there. A cell that is not fine (Cell::is_fine) is small only against the distance of each
/// landmark, and for it the decision is of first order.
bool may_hold_minimum(const Problem& problem, const State& state, double reach, bool is_fine);

/// The singular values (descending) and directions of R with its columns scaled.
struct Directions {
  int unknowns = 0;
  Eigen::Vector3d singular = Eigen::Vector3d::Zero();
  Eigen::Matrix3d u = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d v = Eigen::Matrix3d::Zero();      ///< columns, of the scaled unknowns
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< unknown = scaled * scale
  /// Returns the number of singular values above the level of rounding.
  [[nodiscard]] int rank() const;
};
Directions directions(const Factor& factor, int unknowns);

/// Returns half of chi-squared's second derivative along a direction at a minimum, with the terms beyond first order.
double bend_along(const Problem& problem, const Minimum& minimum, const Eigen::Vector3d& direction);

/// Minimises by Gauss-Newton across the least observed direction, and keeps the state along that direction.
Minimum minimise_across(const Problem& problem, const State& start);

/// Returns `state` moved by a step; the heading stays in (-pi, pi].
State moved(const State& state, const Eigen::Vector3d& step);
/// Returns the step from `a` to `b`; the heading turns by at most half a turn.
Eigen::Vector3d step_between(const State& a, const State& b);

/// Computes the difference of each landmark's numbers from the forecast of the others, as chi-squared: leave-one-out
/// for a landmark that the minimum uses, direct for one that it does not use.
/// @param problem holds the landmarks; the minimum may be that of some of them only
/// @param is_out one entry for each landmark, 1 where the minimum does not use it; null where it uses all
/// @param statistics room for one value for each landmark, or null @returns the largest
double forecast(const Problem& problem, const Minimum& minimum, const char* is_out, double* statistics);

/// Returns chi-squared of one landmark at a state.
double whitened_error2(const Problem& problem, const Landmark& landmark, const State& state);

}  // namespace twocone::localisation::least_squares
