// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone {

/// Pose X_WB of the robot's body B in the world W. World and body are right-handed, x forward, y left, z up
/// (REP 103); the body's origin lies on the floor below the mirrors' common axis.
struct Pose2 {
  double x_m = 0;
  double y_m = 0;
  double heading_rad = 0;  ///< counter-clockwise from world x, in (-pi, pi]

  friend bool operator==(const Pose2&, const Pose2&) = default;
};

}  // namespace twocone
