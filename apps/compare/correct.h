// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "apps/compare/compare.h"

namespace twocone::compare {

/// Returns the real run's robot file with the rig and the wheels that its calibration found. It contains all numbers of
/// the calibration, because they belong together, and not only those that differ. @throws config::FileError as
/// config::robot_text
std::string corrected_robot(const Outcome& outcome, const std::filesystem::path& new_file);

/// Returns the simulated run's robot file, changed so that its next run behaves like the real one. It keeps its own
/// `rig:`, which is that of its scene. For the sources that differ it contains: the mean gain of the colours, noise,
/// blur, rolling shutter, skew, latency and lost frames as effects of the cameras, the frame rate, wheels and slip. The
/// exposure of a real camera cannot be distinguished from its gain. @throws config::FileError as config::robot_text
std::string like_the_real(const Outcome& outcome, const std::filesystem::path& new_file);

}  // namespace twocone::compare
