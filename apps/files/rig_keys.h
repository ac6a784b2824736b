// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "apps/files/robot_file.h"
#include "apps/files/yaml_reader.h"

/// The keys of a robot file's `rig:`. Private to this folder.
namespace twocone::files {

/// Reads `rig:` of the file's outermost mapping, as Section's calls do. Files of `camera_info` are only named by it.
/// @param file that relative paths start from
void read_rig(Section& root, const std::filesystem::path& file, Rig& rig);

using PathChange = std::function<std::filesystem::path(const std::filesystem::path&)>;
/// Gives each `camera_info` of a robot file that has been read without complaint another path.
/// @param change gets the path as resolved against `file`
void set_camera_info_paths(YAML::Node& robot, const std::filesystem::path& file, const PathChange& change);

}  // namespace twocone::files
