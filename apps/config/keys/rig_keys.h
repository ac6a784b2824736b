// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "apps/config/robot_file.h"
#include "apps/config/yaml/yaml_reader.h"

/// The keys of a robot file's `rig:`. Private to this folder.
namespace twocone::config {

/// Reads `rig:` of the outermost mapping and reports errors as the methods of Section do. It stores the paths of
/// `camera_info` and does not read these files. @param file the folder of this file is the base of relative paths
void read_rig(Section& root, const std::filesystem::path& file, Rig& rig);

/// Makes the path of each `camera_info` absolute, in a robot file that was read without errors as `file`.
void make_camera_infos_absolute(YAML::Node& robot, const std::filesystem::path& file);

}  // namespace twocone::config
