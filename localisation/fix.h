// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>

namespace twocone::localisation {

/// Why a position is given or withheld.
enum class FixVerdict {
  kOk,
  kGap,        ///< given, but two of the circles did not meet: the middle of the gap between them was used
  kAmbiguous,  ///< two positions explain the ranges equally well; both are given
  kTooFew,     ///< fewer than three landmarks with a range; nothing is given
};
/// As in fixes.csv: ok, gap, ambiguous, too_few.
std::string_view to_string(FixVerdict verdict);

/// One position of the robot from one stereo frame, world frame.
struct Fix {
  FixVerdict verdict = FixVerdict::kTooFew;
  std::optional<Eigen::Vector2d> position_m;
  std::optional<Eigen::Vector2d> other_position_m;  ///< the second answer of kAmbiguous
  std::optional<double> heading_rad;                ///< where the method gives one, (-pi, pi]
  std::optional<Eigen::Matrix3d> covariance;        ///< of x (m), y (m), heading (rad), where the method states one
  int used = 0;                                     ///< landmarks that the answer rests on
  int unusable = 0;                                 ///< ranges left out because they are negative or not finite
};

}  // namespace twocone::localisation
