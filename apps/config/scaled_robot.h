// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/robot_file.h"

namespace twocone::config {

/// Returns the robot with the images of its pair scaled by `k`, > 0. Width and height are rounded to whole pixels. All
/// values in pixels of these images, in `rig:` and in the cameras' effects, are scaled too. A coordinate c becomes
/// (c + 0.5) k - 0.5.
Robot scaled(Robot robot, double k);

}  // namespace twocone::config
