// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// Returns the first difference between the outline_of() of the robot's map and that of the world, as a message; empty:
/// they agree.
std::string first_difference(const std::string& of_map, const std::string& of_world);

}  // namespace twocone::sim_povray
