// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <optional>

#include <Eigen/Core>

#include "vision/calibration.h"

namespace twocone::vision::calibration {

/// Whether sightings, or pointers to them, are of more than one landmark. @param landmark their member that tells which
template <typename Sightings, typename Landmark>
bool show_two_landmarks(const Sightings& sightings, Landmark landmark) {
  return std::ranges::adjacent_find(sightings, std::ranges::not_equal_to{}, landmark) != sightings.end();
}

/// A pose (x m, y m, heading rad) to begin from: each sighting tells where in the body frame the landmark stands (its
/// ray meets the known height of the top); the turn and shift that most of these agree with, tried for each two
/// landmarks. Nothing where fewer than two landmarks agree to kAgree_m.
std::optional<Eigen::Vector3d> start_pose(const Rig& rig, const std::vector<KnownLandmark>& landmarks,
                                          const CalibrationFrame& frame);

/// Half a degree of tilt is 6 px of radius or some 0.15 m of range at 2.5 m in the lab's mirrors; wrong matches are
/// farther.
constexpr double kAgree_m = 0.4;

}  // namespace twocone::vision::calibration
