// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/survey/overlay.h"
#include "base/plane.h"
#include "hal/result.h"

/// A survey beside a map that was measured.
namespace twocone::survey {

/// A landmark that is not where the measured map has it.
struct MovedLandmark {
  std::string name;
  Eigen::Vector2d by_m = Eigen::Vector2d::Zero();  ///< where it is minus where the map has it
  double sigma_m = 0;                              ///< greatest standard deviation of `by_m`
};

struct MapMatch {
  Overlay overlay;  ///< from the survey's world to the measured map's
  /// The surveyed landmarks in the map's world, and what is known of them without the survey: names, numbers and sigmas
  /// of the map. Places of landmarks that moved, and all of those that the map does not have, are the survey's; the
  /// sigmas of these numbers are infinite.
  std::vector<Landmark> landmarks;
  std::vector<MovedLandmark> moved;
  std::vector<std::string> missing;  ///< landmarks of the map that the survey does not have
};

/// Lays a survey onto a measured map, and finds the landmarks that were moved since the map was measured.
///
/// Places are compared by their shape alone: place and direction of the survey's world are free. Of all choices of
/// moved landmarks, less than half of them, it takes the one with the least chi^2 + 18 k, where k is their number and
/// chi^2 the weighted squares of the differences of the others. A landmark that was not moved is then named once in
/// 8,000 (chi^2 of 18 with two degrees of freedom), if the sigmas are right. Where even the best choice leaves more
/// than the sigmas explain, chi^2 is divided by the excess.
/// @param surveyed with hues in linear light and names
/// @param covariance of the surveyed places: x and y of the first, of the second, ... m^2
/// @param measured with sigmas
/// Error: kBadData where fewer than three landmarks of the map were found where it has them.
Result<MapMatch> match_to_map(const std::vector<Landmark>& surveyed, const Eigen::MatrixXd& covariance,
                              const std::vector<Landmark>& measured);

}  // namespace twocone::survey
