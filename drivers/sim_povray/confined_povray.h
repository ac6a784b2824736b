// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/povray.h"
#include "drivers/sim_povray/render/scene_access.h"
#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"

/// POV-Ray for a scene that may be somebody else's: the one place where its limits are set.
namespace twocone::sim_povray {

/// What the scene of `place` may read, and where its files are looked for, those that it includes being known.
[[nodiscard]] SceneAccess access_of(const PlaceSettings& place, const SceneCalls& calls);

/// POV-Ray, confined to what access_of() says (Confinement).
/// Errors: kUnavailable (no POV-Ray); kRefused, where reading cannot be confined by the kernel: the scene names a file
/// outside, with file and line.
[[nodiscard]] Result<Povray> confined_povray(const PlaceSettings& place, const SceneCalls& calls);

}  // namespace twocone::sim_povray
