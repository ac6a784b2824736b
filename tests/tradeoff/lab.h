// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"

namespace twocone::tradeoff {

/// The robot and the map of robots/lab_sim.yaml.
struct Lab {
  files::Robot robot = files::read_robot(std::filesystem::path(TWOCONE_SOURCE_DIR) / "robots/lab_sim.yaml");
  files::Map map = files::read_map(robot.map);
};

}  // namespace twocone::tradeoff
