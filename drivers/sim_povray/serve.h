// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// Runs a world for other programs of the same user on this machine, who attach to it by `name`
/// (Simulation::attach), until `stop` is set. The world steps when every attached robot has asked for its next frame;
/// when the last has left it begins anew. A program that dies leaves its robot standing; the others go on.
/// So does one that asks for nothing for 30 s while others wait for it.
/// @param name letters, digits, - and _, at most 64
/// @param tell one line for a person whenever the world is ready and a robot comes or goes; from several threads, one
/// at
///        a time
/// Errors: as Simulation::open; kRefused (the name is served already; the runtime folder is somebody else's),
/// kUnavailable (no socket to be had). @throws std::invalid_argument naming every bad field of `place`
Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& tell, const std::atomic<bool>& stop);

}  // namespace twocone::sim_povray
