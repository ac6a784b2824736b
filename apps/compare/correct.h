// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/compare/compare.h"

namespace twocone::compare {

/// The real run's robot file with what was found of its rig and wheels: all of the calibration, whose numbers belong
/// together, not those alone that differ. @throws files::FileError as files::robot_text
std::string corrected_robot(const Outcome& outcome, const std::filesystem::path& new_file);

/// The simulated run's robot file, whose next run behaves like the real one: its own `rig:`, which is that of its
/// scene, and of what differs: colours' mean gain, noise, blur, rolling shutter, skew, latency and lost frames as
/// effects of the cameras, the frame rate, wheels and slip. A real camera's exposure is not told from its gain.
/// @throws files::FileError as files::robot_text
std::string like_the_real(const Outcome& outcome, const std::filesystem::path& new_file);

/// What to change, a sentence for each source that differs: Source::advice.
void advise(std::vector<Source>& sources);

}  // namespace twocone::compare
