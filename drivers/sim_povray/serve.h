// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "drivers/sim_povray/place.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Runs a world for other programs of the same user on this machine until `stop` is set. They attach to it by `name`
/// (Simulation::attach). The world steps when every attached robot has requested its next frame; when the last one has
/// left, it returns to time 0. If a program dies, its robot stays where it is, and the others continue. The same holds
/// for a program that requests nothing for 30 s while others wait for it.
/// @param name letters, digits, - and _, at most 64
/// @param report one line for a person when the world is ready and whenever a robot joins or leaves; from several
/// threads, one at a time
/// Errors: as Simulation::open; kRefused (the name is already served; the runtime folder belongs to another user),
/// kUnavailable (no socket is available). @throws std::invalid_argument naming every bad field of `place`
Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop);

}  // namespace twocone::sim_povray
