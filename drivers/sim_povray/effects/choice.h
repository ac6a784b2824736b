// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/scene/scene.h"

/// Chooses how a scene is rendered: with all effects that it uses and no others.
namespace twocone::sim_povray {

/// POV-Ray's +Q for a scene without media, fog, photons, radiosity and subsurface light: 8 leaves out these and nothing
/// else, so that the pixels are those of 9 (tests/sim_povray/effects_test.cpp checks it). Levels above 9 add nothing.
constexpr int kPlainQuality = 8;
constexpr int kFullQuality = 9;

struct RenderChoice {
  Scene scene;       ///< without the effects that are switched off; its lines are those of the file
  SceneCalls calls;  ///< effects that this scene uses
  int quality = kFullQuality;
  std::string why_quality{};  ///< reason for kFullQuality: `scenes/fog.pov:12: fog`; empty at kPlainQuality
  /// Why the pixels outside the mirror must be rendered too, as whole_image does: POV-Ray's result for a pixel depends
  /// on the pixels that it rendered before. Empty: they need not be.
  std::string why_whole{};
  /// Why a process cannot be held between images: the scene asks, or may ask, which frame of an animation it is, or has
  /// photons, which POV-Ray carries over from one image to the next. Empty: it can.
  std::string one_shot{};
};

/// Errors: kRefused, as switched().
[[nodiscard]] Result<RenderChoice> choose_rendering(const Scene& scene, const SceneSwitches& switches,
                                                    const SceneAccess& access);

}  // namespace twocone::sim_povray
