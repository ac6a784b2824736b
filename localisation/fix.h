// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/shared_errors.h"

namespace twocone::localisation {

/// The reason why a position is given or withheld.
enum class FixVerdict {
  kOk,
  kGap,            ///< given, but two of the circles do not meet: the middle of the gap between them was used
  kAmbiguous,      ///< two positions explain the ranges equally well; both are given
  kTooFew,         ///< fewer landmarks than a position needs (paper: three ranges); nothing is given
  kWeak,           ///< given, but one direction is not observed to first order: Fix::unseen_direction
  kContradictory,  ///< the measurements contradict each other, and nothing shows which is wrong; nothing is given
  kOutOfBounds,    ///< given for information, but the robot cannot be there: outside the map's bounds
};
/// Returns the name in fixes.csv: ok, gap, ambiguous, too_few, weak, contradictory, out_of_bounds.
inline std::string_view to_string(FixVerdict verdict) {
  constexpr std::array<std::string_view, 7> kNames{"ok",   "gap",           "ambiguous",    "too_few",
                                                   "weak", "contradictory", "out_of_bounds"};
  return kNames.at(std::size_t(verdict));
}

/// The measurement of one landmark whose axis is at a known place in the world.
struct LandmarkMeasurement {
  Eigen::Vector2d landmark_m = Eigen::Vector2d::Zero();
  std::optional<double> range_m;      ///< horizontal, from the body's origin to the landmark's axis, >= 0
  std::optional<double> bearing_rad;  ///< in the body frame
  /// Of (range m, bearing rad), symmetric and positive definite; row and column of an empty field are not read. It is
  /// that of the measurement's own noise, which is independent of all other measurements.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  /// Of measured minus true (range m, bearing rad), by errors of the rig and of the landmark's size.
  BySharedErrors<2> by_shared{};
  /// Of true minus believed place of the landmark (x m, y m), by errors of the map.
  BySharedErrors<2> place_by_shared{};
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
  /// The part of `covariance` that the measurements' own noise causes. It averages away over frames; the rest, which is
  /// by_shared by_shared^T, does not. Empty for kWeak, and where the method states no covariance.
  std::optional<Eigen::Matrix3d> own_covariance;
  std::optional<Eigen::Matrix3d> other_own_covariance;
  /// Of estimated minus true (x m, y m, heading rad); empty for kWeak.
  BySharedErrors<3> by_shared;
  BySharedErrors<3> other_by_shared;
  /// Factor by which the covariances were multiplied because the measurements scatter more than their sigmas; 1: none.
  /// What is added counts as own noise.
  double widening = 1;
  /// kWeak: unit vector of (x, y, heading) along which the measurements give no information to first order. The
  /// covariance is of first order across it. Along it, the covariance is the likelihood's mean square near the
  /// position, which is finite even where nothing bounds it, and is not reliable. Code that uses the fix elsewhere
  /// along this direction must follow the measurements, not the line.
  std::optional<Eigen::Vector3d> unseen_direction;
  /// kWeak: the measurements of the fix, without the outliers. The position may be far along an arc from the robot, so
  /// code with more information, such as the filter, starts from these measurements and not from the tangent at the
  /// position.
  std::vector<LandmarkMeasurement> measurements;
  std::vector<int> outliers;   ///< indices of the measurements that were found wrong and left out
  double chi_squared = 0;      ///< whitened, of the used measurements; where the method states a covariance
  int degrees_of_freedom = 0;  ///< measured numbers minus unknowns (kWeak: minus the observed ones)
  int used = 0;                ///< number of landmarks used for the answer
  int unusable = 0;            ///< measurements left out because they are invalid (negative range, not finite)
};

/// Returns whether a behaviour may steer by the position as that of the robot. It may not for kWeak, whose position may
/// be anywhere along its unseen direction, for kOutOfBounds, and for one of two answers.
inline bool is_place(const Fix& fix) {
  const bool is_given = fix.verdict == FixVerdict::kOk || fix.verdict == FixVerdict::kGap;
  return is_given && fix.position_m && !fix.other_position_m;
}

}  // namespace twocone::localisation
