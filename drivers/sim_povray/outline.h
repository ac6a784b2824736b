// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// What the robot's map says and the world says not, or the other way round, of two outline_of(); empty: they agree.
std::string first_difference(const std::string& of_map, const std::string& of_world);

}  // namespace twocone::sim_povray
