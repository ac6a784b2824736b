// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "apps/config/robot_file.h"
#include "apps/config/yaml/yaml_reader.h"
#include "drivers/sim_povray/sim_povray.h"

/// The keys for simulated bodies and cameras in a robot file: `effects`, `effects.camera` for all cameras and
/// `cameras.NAME.effects` for one. Private to this folder.
namespace twocone::config {

/// Reads the keys of `effects:` except `camera`. Returns the section `camera`, with the effects that all cameras share,
/// or null.
Section* read_effects(Section& root, Effects& effects);

/// Overwrites `effects` with the keys that are present. Returns whether all of them were valid.
bool read_camera_effects(Section& section, sim_povray::CameraEffects& effects);

/// Complains about valid values that contradict each other in one camera. The complaint goes to the section that has
/// the key; the camera's own section comes before the common one. Either may be null. @param rate_hz of the camera, if
/// known
void check_camera_effects(const sim_povray::CameraEffects& effects, Section* own, Section* common,
                          std::optional<double> rate_hz);

/// Complains about keys that have no effect, because none of the sections has the key on which they depend.
void check_unneeded_keys(std::span<Section* const> sections);

/// Changes `effects` in a robot file that was read without errors: writes the keys of `effects:`, except `camera`, that
/// differ from `read`. Default values are left out, and so is an empty section.
void set_effects(YAML::Node& robot, const Effects& changed, const Effects& read);

/// Writes the keys of `cameras.NAME.effects` that differ from `read`. Values of `effects.camera` are not repeated,
/// except for keys on which others depend. @param file named in messages
/// @throws FileError if the effects of a real camera differ
void set_camera_effects(YAML::Node& robot, const std::string& name, const CameraEntry& changed, const CameraEntry& read,
                        const std::filesystem::path& file);

}  // namespace twocone::config
