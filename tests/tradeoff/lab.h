// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"

namespace twocone::tradeoff {

/// The robot of robots/lab_sim.yaml, and its map.
struct Lab {
  config::Robot robot = config::read_robot(std::filesystem::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml");
  config::Map map = config::read_map(robot.map);
};

}  // namespace twocone::tradeoff
