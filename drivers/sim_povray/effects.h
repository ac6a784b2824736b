// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"

/// The one table of effects: what calls for each, whether it is on and why, what it costs and how it is switched.
namespace twocone::sim_povray {

struct EffectRow {
  std::string kind;    ///< rendering, camera, motion
  std::string effect;  ///< shadows, rolling shutter, wheel slip, ...
  bool on = false;
  std::string reason;  ///< `scenes/lab.pov:76: light_source`; or what would call for it
  std::string how;     ///< what switches it, the key or the section of the reason's key: `map effects.shadows`
  std::string cost;    ///< in words: "8 pictures for one"
};

/// Where keys stand: of the robot file "effects.slip" -> "robots/lab_sim.yaml:58", of the map "map.effects.shadows".
using KeyPlaces = std::map<std::string, std::string>;

/// Every effect there is, always the same rows in the same order. Errors: as Simulation::open.
[[nodiscard]] Result<std::vector<EffectRow>> effect_table(const PlaceSettings& place, const SeatSettings& seat,
                                                          const std::vector<ViewSettings>& views,
                                                          const KeyPlaces& places);

/// How POV-Ray is kept from files, in a sentence.
[[nodiscard]] std::string describe_confinement(const PlaceSettings& place);

/// One view's picture of the start, made in two ways. Everything: POV-Ray's highest quality, reflections at least 20
/// deep, nothing that the map switches off, the whole picture, and every stage of the camera passed through at its
/// neutral value. The choice: as choose_rendering() says, and what is in the mirror only where that changes nothing.
/// What a camera is asked for (noise, ...) would change both alike and is left out.
struct Verification {
  std::string view;
  int pixels = 0;           ///< compared: those inside the mirror; all where none is found or the whole picture is made
  int different = 0;        ///< of them, in any channel
  int greatest = 0;         ///< difference, of 255
  double mean = 0;          ///< difference over pixels and channels, of 255
  double everything_s = 0;  ///< processor time of POV-Ray for one picture, the median of three, started for each
  double choice_s = 0;
  bool is_time_told = false;  ///< all three of the one are above all three of the other: else the gap is noise
  /// Where pixels differ: what makes them, with file and line as far as it is known.
  std::string why{};
  /// Whether that is what the scene's or the map's own words ask for (a depth of reflections, an effect switched off).
  /// What differs otherwise should not.
  bool is_asked_for = false;
};
/// Errors: as Simulation::open, and those of Povray::render. No other child of this program may end meanwhile: its time
/// would count.
[[nodiscard]] Result<std::vector<Verification>> verify_effects(const PlaceSettings& place, const SeatSettings& seat,
                                                               const std::vector<ViewSettings>& views,
                                                               const CameraSettings& size);

}  // namespace twocone::sim_povray
