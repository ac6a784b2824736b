// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "apps/config/yaml/yaml_reader.h"
#include "drivers/sim_povray/camera_effects.h"

/// The keys for simulated cameras in a robot file: `effects.camera` for all, `cameras.NAME.effects` for one.
namespace twocone::config {

/// Overwrites `effects` with the keys that are present. Returns whether all of them were valid.
bool read_camera_effects(Section& section, sim_povray::CameraEffects& effects);

/// Complains about valid values that contradict each other in one camera. The complaint goes to the section that has
/// the key; the camera's own section comes before the common one. Either may be null. @param rate_hz of the camera, if
/// known
void check_camera_effects(const sim_povray::CameraEffects& effects, Section* own, Section* common,
                          std::optional<double> rate_hz);

/// Complains about keys that have no effect, because none of the sections has the key on which they depend.
void check_unneeded_keys(std::span<Section* const> sections);

}  // namespace twocone::config
