// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/place.h"

namespace twocone::sim_povray {

/// Describes the walls, solids and moving things of a place in text, one line each, to a millimetre. The programs of
/// one world must agree on it. At most 4 kB: a checksum replaces the lines beyond that.
std::string outline_of(const PlaceSettings& place);

/// Returns the first difference between the outline_of() of the robot's map and that of the world, as a message; empty:
/// they agree.
std::string first_difference(const std::string& of_map, const std::string& of_world);

}  // namespace twocone::sim_povray
