// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "base/plane.h"

namespace twocone::behaviours {

using Outline = std::vector<Eigen::Vector2d>;  ///< corners of a simple polygon, world frame, metres

/// The area in which a robot may drive, according to its map: inside the walls and outside every obstacle.
struct Arena {
  Eigen::Vector2d min_m, max_m;
  std::vector<Outline> outlines;
  std::vector<Disc> discs;

  /// Returns the distance from `p_m` to the nearest wall or obstacle, metres; negative inside an obstacle or beyond a
  /// wall.
  [[nodiscard]] double clearance_m(const Eigen::Vector2d& p_m) const;
};

}  // namespace twocone::behaviours
