// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/config/robot_file.h"

namespace twocone::config {

/// Returns the text of a robot file that equals `original` except for the values in `changed` of: `rig:`, the two wheel
/// sizes, width_px, height_px, rate_hz, antialias and effects of the pair, `effects:` of the body, and `estimator:`.
/// Additional cameras take the pair's rate, and so does max_skew_s where `original` does not set it.
///
/// The effects of one camera are written into its own `effects`. Only the keys that differ from `original` are written.
/// `effects.camera` stays unchanged, because it also applies to the additional cameras.
///
/// Numbers are printed so that they read back equal. Mirror sizes are written in `rig:` if both mirrors share them, and
/// otherwise in `lower:` and `upper:`. Default values are left out. A view that still has the lens and the image size
/// of its `camera_info` names that file. Any other view has the numbers themselves. `map` and `camera_info` are written
/// relative to the folder of the new file, unless they are absolute in `original`. Comments are lost, and the text
/// states that.
/// @param new_file path for which the text is made; this function writes no file
/// @param header_lines comments at the start, after the licence line
/// @throws FileError as read_robot, for `original`; for numbers that read_robot would reject in the new file; for
/// changed effects of a camera that is not simulated in `original`
std::string robot_text(const std::filesystem::path& original, const std::filesystem::path& new_file,
                       const Robot& changed, const std::vector<std::string>& header_lines);

}  // namespace twocone::config
