// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace twocone::localisation {

/// Why a position is given or withheld.
enum class FixVerdict {
  kOk,
  kGap,            ///< given, but two of the circles did not meet: the middle of the gap between them was used
  kAmbiguous,      ///< two positions explain the ranges equally well; both are given
  kTooFew,         ///< fewer landmarks than a position takes (paper: three ranges); nothing is given
  kWeak,           ///< given, but one direction is not seen to first order: Fix::unseen_direction
  kContradictory,  ///< the measurements contradict each other, and nothing tells which is wrong; nothing is given
};
/// As in fixes.csv: ok, gap, ambiguous, too_few, weak, contradictory.
std::string_view to_string(FixVerdict verdict);

/// One position of the robot from one stereo frame, world frame.
struct Fix {
  FixVerdict verdict = FixVerdict::kTooFew;
  std::optional<Eigen::Vector2d> position_m;
  std::optional<Eigen::Vector2d> other_position_m;  ///< the second answer of kAmbiguous
  std::optional<double> heading_rad;                ///< where the method gives one, (-pi, pi]
  std::optional<Eigen::Matrix3d> covariance;        ///< of x (m), y (m), heading (rad), where the method states one
  std::optional<double> other_heading_rad;
  std::optional<Eigen::Matrix3d> other_covariance;
  /// Factor that the covariances hold because the measurements scatter more than they say; 1 for none.
  double widening = 1;
  /// kWeak: unit vector of (x, y, heading) along which the measurements do not tell to first order. The covariance is
  /// then that across it, with infinity nowhere: its own entry is left out (zero information, not a number).
  std::optional<Eigen::Vector3d> unseen_direction;
  std::vector<int> outliers;   ///< indices of the measurements that were found wrong and left out
  double chi_squared = 0;      ///< of what was used about the answer, whitened; where the method states a covariance
  int degrees_of_freedom = 0;  ///< measured numbers less unknowns (kWeak: less those seen)
  int used = 0;                ///< landmarks that the answer rests on
  int unusable = 0;            ///< measurements left out because they are no numbers (negative range, not finite)
};

}  // namespace twocone::localisation
