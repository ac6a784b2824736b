// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/sim_povray.h"

/// How a scene is rendered: with all that it calls for and nothing else.
namespace twocone::sim_povray {

/// POV-Ray's +Q for a scene without media, fog, photons, radiosity and subsurface light: 8 leaves out these and nothing
/// else, so that the pixels are those of 9 (tests/sim_povray/effects_test.cpp holds it). Levels above 9 add nothing.
constexpr int kPlainQuality = 8;
constexpr int kFullQuality = 9;

struct RenderChoice {
  std::string text;  ///< the scene's, without what is switched off; lines are those of the file
  SceneCalls calls;  ///< of that text
  int quality = kFullQuality;
  std::string why_quality;  ///< why not less: `scenes/fog.pov:12: fog`; empty at kPlainQuality
  /// Why what is outside the mirror has to be rendered too, as whole_picture does: what POV-Ray makes of a pixel hangs
  /// on those it made before. Empty: it has not.
  std::string why_whole;
  /// Why a process cannot be held between pictures: the scene asks, or may ask, which frame of an animation it is, or
  /// has photons, which POV-Ray carries over from one picture to the next. Empty: it can.
  std::string one_shot;
};

/// Errors: kRefused, as switched().
[[nodiscard]] Result<RenderChoice> choose_rendering(const Scene& scene, const SceneSwitches& switches,
                                                    const SceneAccess& access);

}  // namespace twocone::sim_povray
