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

/// What one set of landmarks tells, outliers or not.
struct Answer {
  FixVerdict verdict = FixVerdict::kTooFew;  ///< kOk, kAmbiguous, kWeak, kTooFew, kContradictory (no minimum found)
  Place place;
  std::optional<Place> other;
  std::optional<Eigen::Vector3d> unseen;  ///< unit vector, in units of the frame and rad
  double chi_squared = 0;
  int degrees_of_freedom = 0;
  /// Whether chi-squared is what noise makes: of all together, and of each landmark against the others.
  bool is_consistent = false;
  Minimum minimum;  ///< of `place`
};

/// Noise alone is called a contradiction so often: once by chi-squared of all, and once by the worst landmark.
constexpr double kFalseAlarm = 1e-4;

/// A local minimum whose chi-squared is at most so much above the lowest is a rival: the second answer of kAmbiguous.
/// What lies higher is less likely by exp(-27 / 2) = 1.4e-6: the chance that the answer withheld was the right one.
constexpr double kRival = 27;

/// Sigmas may be too small by three times, all of them alike, before that is called a contradiction.
constexpr double kMostRatio = 9;

/// Two answers are two where chi-squared between them rises by so much over the worse; else they are one that is not
/// seen to first order. Of a quartic double well, whose answers have sigma s and lie at +-a, it rises by (a / 2 s)^2:
/// here 6 sigma either side.
constexpr double kRidge = 9;

Answer solve(const Problem& problem);

}  // namespace twocone::localisation::least_squares
