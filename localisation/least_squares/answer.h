// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/least_squares/solver.h"

namespace twocone::localisation::least_squares {

/// A pose with its covariance, in the problem's frame. The heading's row and column are zero where there is no heading.
struct Place {
  State state;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// The answer of one set of landmarks, with or without outliers.
struct Answer {
  FixVerdict verdict = FixVerdict::kTooFew;  ///< kOk, kAmbiguous, kWeak, kTooFew, kContradictory (no minimum found)
  Place place;
  std::optional<Place> other;
  std::optional<Eigen::Vector3d> unseen;  ///< unit vector, in units of the frame and rad
  double chi_squared = 0;
  int degrees_of_freedom = 0;
  /// Whether noise explains chi-squared: of all landmarks together, and of each landmark against the others.
  bool is_consistent = false;
  Minimum minimum;  ///< of `place`
};

/// The false-alarm rate of a contradiction by noise alone: once for chi-squared of all, and once for the worst
/// landmark.
constexpr double kFalseAlarm = 1e-4;

/// A local minimum whose chi-squared is at most this much above the lowest is a rival: the second answer of kAmbiguous.
/// A higher one is less likely by exp(-27 / 2) = 1.4e-6, which is the probability that the omitted answer was the right
/// one.
constexpr double kRival = 27;

/// Limit of chi-squared over its degrees of freedom. All sigmas may be too small by a common factor of three, the
/// square root of the limit, before that is a contradiction.
constexpr double kMostRatio = 9;

/// Two minima are two answers if chi-squared between them rises by this much over the worse one. Otherwise they are one
/// answer that is not observed to first order. In a quartic double well with minima of sigma s at +-a, it rises by
/// (a / 2 s)^2, so 9 is reached where a is 6 sigma.
constexpr double kRidge = 9;

/// Solves the problem with all its landmarks.
Answer solve(const Problem& problem);

/// The answer after the wrong landmarks are left out.
struct Cleaned {
  std::vector<int> left_out;  ///< indices into Problem::landmarks, ascending
  Answer answer;              ///< of the others
};

/// Two against one cannot be decided: when two labels are exchanged, the two exchanged landmarks agree.
constexpr int kFewestBelieved = 3;
/// Up to this number of landmarks, every single one and every pair is left out in turn.
constexpr int kMostTriedInTurn = 8;

/// Solves an inconsistent problem without its wrong landmarks. Returns nothing where no set can be left out so that the
/// others agree, or where several such sets give different places. Fewer are left out than believed, and
/// kFewestBelieved or more are believed.
///
/// Up to kMostTriedInTurn landmarks: leaves out each one, then each pair, and takes the smallest set without which the
/// others are consistent. If there is no such set, or with more landmarks, it uses consensus. Small samples (two
/// landmarks where all have range and bearing, else three) are drawn in a fixed order that spreads evenly, and each
/// gives a place. Places are rated by the errors of the landmarks there, each counted up to the false-alarm limit only.
/// The number of samples is such that a sample without an outlier is missed with a probability of 1e-9, given the share
/// of landmarks that agree so far. From the best few places the landmarks that agree are fitted, and selected again by
/// the forecast of the fit, until the set does not change. The cost is linear in the landmarks.
std::optional<Cleaned> without_outliers(const Problem& problem);

}  // namespace twocone::localisation::least_squares
