// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "apps/files/yaml_reader.h"
#include "drivers/sim_povray/sim_povray.h"

/// What a robot file says of its simulated cameras: `effects.camera` for all, `cameras.NAME.effects` for one.
namespace twocone::files {

/// Reads the keys that are there over what `effects` holds. Whether all were good.
bool read_camera_effects(Section& section, sim_povray::CameraEffects& effects);

/// Complains about what of good values does not go together in one camera, at the section that says it: the camera's
/// own before the common one. Either may be absent. @param rate_hz of the camera, if it is known
void check_camera_effects(const sim_povray::CameraEffects& effects, Section* own, Section* common,
                          std::optional<double> rate_hz);

/// Complains about keys that do nothing, since what they belong to is in none of the sections.
void check_unneeded_keys(std::span<Section* const> sections);

}  // namespace twocone::files
