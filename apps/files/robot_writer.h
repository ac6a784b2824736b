// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/files/robot_file.h"

namespace twocone::files {

struct WheelSizes {
  double separation_m = 0;  ///< > 0
  double radius_m = 0;      ///< > 0
};

/// The text of a robot file that is `original` but for what `changed` says of its `rig:`, the two wheel sizes,
/// width_px, height_px, rate_hz, antialias and effects of the pair, `effects:` of the body, and `estimator:`. Further
/// cameras follow the pair's rate, and so does max_skew_s where `original` has none.
///
/// Effects of one camera go into its own `effects`, key by key those that differ from what `original` makes of it:
/// `effects.camera` stays as it is, since further cameras have it too.
///
/// Numbers are printed so that they read back equal. Mirror sizes stand in `rig:` where both mirrors have the same, and
/// in `lower:` and `upper:` where not; what is as by default is left out. A view that still has lens and picture size
/// of its `camera_info` names that file, any other has its numbers. `map` and `camera_info` are written as seen from
/// the new file's folder, unless `original` has them absolute. Comments are lost, and the text says so.
/// @param new_file where the text will be put; nothing is written here
/// @param header_lines put in front as comments, after the licence's line
/// @throws FileError as read_robot, for `original`; for numbers that the new file would be refused for; for changed
/// effects of a camera that `original` does not simulate
std::string robot_text(const std::filesystem::path& original, const std::filesystem::path& new_file,
                       const Robot& changed, const std::vector<std::string>& header_lines);

/// The same with only `rig:` and wheel sizes changed: what a calibration found.
std::string calibrated_robot_text(const std::filesystem::path& original, const std::filesystem::path& new_file,
                                  const Rig& rig, const WheelSizes& wheels,
                                  const std::vector<std::string>& header_lines);

}  // namespace twocone::files
