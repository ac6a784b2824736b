// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/files/robot_file.h"
#include "apps/files/yaml_reader.h"

/// Changes `effects` in a robot file that has been read without complaint. Private to this folder.
namespace twocone::files {

/// `effects:` but for its `camera`, key by key what differs from `read`; what is as by default is left out, and the
/// section too where nothing is left of it.
void set_effects(YAML::Node& robot, const Effects& changed, const Effects& read);

/// `cameras.NAME.effects`, key by key what differs from `read`. What `effects.camera` says is not said again, but for
/// keys that others depend on. @throws FileError where a real camera's effects differ
/// @param file named in messages
void set_camera_effects(YAML::Node& robot, const std::string& name, const CameraEntry& changed, const CameraEntry& read,
                        const std::filesystem::path& file);

}  // namespace twocone::files
