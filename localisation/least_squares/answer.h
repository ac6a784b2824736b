// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

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

/// All sigmas may be too small by a common factor of three before that is a contradiction.
constexpr double kMostRatio = 9;

/// Two minima are two answers if chi-squared between them rises by this much over the worse one; otherwise they are one
/// answer that is not observed to first order. In a quartic double well with minima of sigma s at +-a, it rises by
/// (a / 2 s)^2: here 6 sigma to either side.
constexpr double kRidge = 9;

Answer solve(const Problem& problem);

}  // namespace twocone::localisation::least_squares
