// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// Gauss-Newton with Levenberg's damping, which is none while steps succeed. Ends when the step is below rounding, or
/// when it no longer shrinks and what it could win is below rounding; not converged after kMaxSteps.
Minimum minimise(const Problem& problem, const State& start);
constexpr int kMaxSteps = 60;

/// The singular values (falling) and directions of R with its columns scaled to norm 1.
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

/// Gauss-Newton across the least seen direction: a state that the others agree on, with the given one along it.
Minimum minimise_across(const Problem& problem, const State& start);

/// `state` moved by a step; the heading stays in (-pi, pi].
State moved(const State& state, const Eigen::Vector3d& step);
/// The step from `a` to `b`, the heading by the short way.
Eigen::Vector3d step_between(const State& a, const State& b);

/// Leave-one-out chi-squared of each landmark of a minimum: what its numbers differ from the others' forecast of them.
/// @param statistics room for one each, or null @returns the largest
double leave_one_out(const Problem& problem, const Minimum& minimum, double* statistics);

}  // namespace twocone::localisation::least_squares
