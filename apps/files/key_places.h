// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "drivers/sim_povray/effects.h"

namespace twocone::files {

/// Where the keys of the robot file stand, "effects.slip" -> "robots/lab_sim.yaml:58", and those of its map, with a
/// prefix: "map.effects.shadows" -> "scenes/lab.map.yaml:53". Keys inside lists are left out; the list's own is there.
/// Reads both files again. @throws FileError as read_robot for files that cannot be read
sim_povray::KeyPlaces key_places(const Robot& robot, const Map& map);

}  // namespace twocone::files
