// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <optional>

#include <Eigen/Core>

#include "vision/calibration.h"

namespace twocone::vision::calibration {

/// Returns whether sightings, or pointers to them, are of more than one landmark.
/// @param landmark their member that identifies the landmark
template <typename Sightings, typename Landmark>
bool show_two_landmarks(const Sightings& sightings, Landmark landmark) {
  return std::ranges::adjacent_find(sightings, std::ranges::not_equal_to{}, landmark) != sightings.end();
}

/// A start pose (x m, y m, heading rad). Each sighting gives the landmark's place in the body frame (its ray meets the
/// known height of the top). The pose is the rotation and translation with which most of these places agree, tried for
/// every two landmarks. Nothing where fewer than two landmarks agree to kAgree_m.
std::optional<Eigen::Vector3d> start_pose(const Rig& rig, const std::vector<Landmark>& landmarks,
                                          const CalibrationFrame& frame);

/// Half a degree of tilt is 6 px of radius or some 0.15 m of range at 2.5 m in the lab's mirrors; wrong matches are
/// farther off.
constexpr double kAgree_m = 0.4;

}  // namespace twocone::vision::calibration
