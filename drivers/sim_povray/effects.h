// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/camera.h"
#include "hal/image.h"
#include "hal/result.h"

/// The table of all effects: what activates each, whether it is on and why, what it costs and how it is switched. Also
/// a check that effects which a scene does not use change nothing.
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

/// One view's image of the start, rendered in two ways. `everything`: POV-Ray's highest quality, reflections at least
/// 20 deep, no effect switched off by the map, the whole image, and every camera stage applied at its neutral value.
/// `choice`: as choose_rendering() decides, and limited to the mirror only where that changes nothing. The effects that
/// a camera's settings request (noise, ...) would change both alike and are left out.
struct Verification {
  std::string view;
  int pixels = 0;           ///< compared pixels: those inside the mirror; all if none is found or all are rendered
  int different = 0;        ///< pixels that differ in any channel
  int greatest = 0;         ///< greatest difference, of 255
  double mean = 0;          ///< mean difference over pixels and channels, of 255
  double everything_s = 0;  ///< POV-Ray's processor time for one image, median of three, each in a new process
  double choice_s = 0;
  bool is_time_sure = false;  ///< all three times of one exceed all three of the other; else the gap is noise
  /// If pixels differ: the cause, with file and line as far as known.
  std::string why{};
  /// Whether the scene's or the map's own text requires the difference (a depth of reflections, an effect switched
  /// off). No other difference should occur.
  bool is_asked_for = false;
};
/// Renders each view in both ways and compares the images. Errors: as Simulation::open, and those of Povray::render.
[[nodiscard]] Result<std::vector<Verification>> verify_effects(const PlaceSettings& place,
                                                               const SessionSettings& session,
                                                               const std::vector<ViewSettings>& views,
                                                               const CameraSettings& size);

/// One view's image of the start, rendered by POV-Ray and by the native renderer: without anti-aliasing, and before any
/// camera stage.
struct RendererComparison {
  std::string view;
  /// What the native renderer does not know: file, line and keyword. Empty: nothing, and the rest is set.
  std::string unknown{};
  std::size_t pixels = 0;     ///< compared pixels: those that show the mirror; all if it is not found
  std::size_t different = 0;  ///< pixels that differ by more than one level of 255 in a channel
  bool is_trusted = false;    ///< few enough for `auto` to choose the native renderer, as far as this image goes
  /// POV-Ray's image, darkened, with the pixels that differ in red.
  Image differences{};
};
/// Compares the renderers in one view. Errors: as Simulation::open, and those of Povray::render.
[[nodiscard]] Result<RendererComparison> compare_renderers(const PlaceSettings& place, const SessionSettings& session,
                                                           const ViewSettings& view, const CameraSettings& size);

}  // namespace twocone::sim_povray
