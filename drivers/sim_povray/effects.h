// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "drivers/sim_povray/camera_effects.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/result.h"

/// The table of all effects: what activates each, whether it is on and why, what it costs and how it is switched.
namespace twocone::sim_povray {

struct EffectRow {
  std::string kind;    ///< rendering, camera, motion
  std::string effect;  ///< shadows, rolling shutter, wheel slip, ...
  bool on = false;
  std::string reason;  ///< `scenes/lab.pov:76: light_source`; or what would activate it
  std::string how;     ///< key that switches it, or the section of the reason's key: `map effects.shadows`
  std::string cost;    ///< in words: "8 images for one"
};

/// File positions of keys: of the robot file "effects.slip" -> "robots/lab_sim.yaml:58", of the map
/// "map.effects.shadows".
using KeyPlaces = std::map<std::string, std::string>;

/// Returns every effect, always the same rows in the same order. Errors: as Simulation::open.
[[nodiscard]] Result<std::vector<EffectRow>> effect_table(const PlaceSettings& place, const SessionSettings& session,
                                                          const std::vector<ViewSettings>& views,
                                                          const KeyPlaces& places);

/// Describes in a sentence how POV-Ray's access to files is confined.
[[nodiscard]] std::string describe_confinement(const PlaceSettings& place);

}  // namespace twocone::sim_povray
