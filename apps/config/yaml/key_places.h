// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "drivers/sim_povray/effects.h"

namespace twocone::config {

/// Returns the line of each key of the robot file, "effects.slip" -> "robots/lab_sim.yaml:58", and of its map, with a
/// prefix: "map.effects.shadows" -> "scenes/lab.map.yaml:53". It contains the key of a list but no keys inside a list.
/// Both files are read again. @throws FileError as read_robot for files that cannot be read
sim_povray::KeyPlaces key_places(const Robot& robot, const Map& map);

}  // namespace twocone::config
