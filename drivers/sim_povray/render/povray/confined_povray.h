// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "hal/result.h"

/// POV-Ray for a scene that may come from other people: the one place where its limits are set.
namespace twocone::sim_povray {

/// Returns POV-Ray, confined to what the scene of `place` may read (SceneAccess), with `calls` or as find_calls()
/// returns them for `scene`.
/// Errors: kUnavailable (no POV-Ray); kNotFound (a folder of scene_paths does not exist); kRefused, if the kernel
/// cannot confine reading: the scene names a file outside, with file and line.
[[nodiscard]] Result<Povray> confined_povray(const PlaceSettings& place, const SceneCalls& calls);
[[nodiscard]] Result<Povray> confined_povray(const PlaceSettings& place, const Scene& scene);

}  // namespace twocone::sim_povray
