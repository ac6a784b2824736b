// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/config/robot_file.h"
#include "apps/config/yaml/yaml_reader.h"

/// Changes `effects` in a robot file that was read without errors. Private to this folder.
namespace twocone::config {

/// Writes the keys of `effects:`, except `camera`, that differ from `read`. Default values are left out, and so is an
/// empty section.
void set_effects(YAML::Node& robot, const Effects& changed, const Effects& read);

/// Writes the keys of `cameras.NAME.effects` that differ from `read`. Values of `effects.camera` are not repeated,
/// except for keys on which others depend. @param file named in messages
/// @throws FileError if the effects of a real camera differ
void set_camera_effects(YAML::Node& robot, const std::string& name, const CameraEntry& changed, const CameraEntry& read,
                        const std::filesystem::path& file);

}  // namespace twocone::config
