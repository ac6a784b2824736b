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
  kOutOfBounds,    ///< given so that it can be seen, but the robot cannot be there: outside the map's bounds
};
/// As in fixes.csv: ok, gap, ambiguous, too_few, weak, contradictory, out_of_bounds.
std::string_view to_string(FixVerdict verdict);

/// What was measured of one landmark whose axis stands at a known place of the world.
struct LandmarkMeasurement {
  Eigen::Vector2d landmark_m = Eigen::Vector2d::Zero();
  std::optional<double> range_m;      ///< horizontal, from the body's origin to the landmark's axis, >= 0
  std::optional<double> bearing_rad;  ///< in the body frame
  /// Of (range m, bearing rad), symmetric and positive definite; of what is not measured, row and column are not read.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

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
  /// first order across it; along it, it is the likelihood's mean square near the position (finite, also where nothing
  /// bounds it), which is no promise: who uses the fix elsewhere along it must follow the measurements, not the line.
  std::optional<Eigen::Vector3d> unseen_direction;
  /// kWeak: what the fix was made from, without the outliers. The place may be far along an arc from where the robot
  /// is, so whoever knows more, as the filter does, starts from these and not from the tangent there.
  std::vector<LandmarkMeasurement> measurements;
  std::vector<int> outliers;   ///< indices of the measurements that were found wrong and left out
  double chi_squared = 0;      ///< of what was used about the answer, whitened; where the method states a covariance
  int degrees_of_freedom = 0;  ///< measured numbers less unknowns (kWeak: less those seen)
  int used = 0;                ///< landmarks that the answer rests on
  int unusable = 0;            ///< measurements left out because they are no numbers (negative range, not finite)
};

/// Whether the position is where the robot is taken to be, so that it may be steered by: not of kWeak, which may lie
/// anywhere along its unseen direction, nor of kOutOfBounds, nor one of two answers.
bool is_place(const Fix& fix);

}  // namespace twocone::localisation
