// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/config/robot_file.h"
#include "hal/image.h"

namespace twocone::runs {

/// A sentence for each mirror that a pair of images does not show where the robot file's `rig:` says, to a pixel, or
/// whose rim does not stand out in them.
std::vector<std::string> rim_warnings(const config::Robot& robot, const Image& lower, const Image& upper);

}  // namespace twocone::runs
