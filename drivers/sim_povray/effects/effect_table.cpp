// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/sim_povray/camera/camera_stage.h"
#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {
namespace {

struct Table {
  const PlaceSettings& place;
  const SessionSettings& session;
  const std::vector<ViewSettings>& views;
  const KeyPlaces& places;
  const SceneCalls& written;
  const RenderChoice& choice;
  std::vector<EffectRow> rows{};

  std::vector<EffectRow> run() {
    rendering();
    camera();
    motion();
    return std::move(rows);
  }

  // ---- rendering

  void rendering() {
    called(Feature::kReflection, "reflection depth", "`reflection`", "reflection_depth", "a ray per mirroring");
    if (rows.back().on) {
      const bool changed = place.switches.reflection_depth.has_value();
      const int depth =
          place.switches.reflection_depth.value_or(written.max_trace_level.value_or(kUsualReflectionDepth));
      rows.back().reason += fmt::format(", {} deep{}", depth, changed ? ": " + at("map.effects.reflection_depth") : "");
    }
    called(Feature::kShadows, "shadows", "`light_source` with shadows", "shadows", "a ray per light");
    called(Feature::kTransparency, "refraction, transparency", "`transmit`, `filter` or `ior`", "",
           "a ray per surface");
    called(Feature::kAreaLights, "area lights", "`area_light`", "area_lights", "many rays per light");
    called(Feature::kMedia, "media", "`media` or `fog`", "media", "samples on each ray");
    called(Feature::kPhotons, "photons", "`photons`", "photons", "photons per image");
    called(Feature::kRadiosity, "radiosity", "`radiosity`", "radiosity", "light is gathered");
    called(Feature::kSubsurface, "subsurface light", "`subsurface`", "", "many rays per point");

    EffectRow row{"rendering", "anti-aliasing", false, "", "robot cameras", "n x n rays at edges"};
    std::vector<std::string> names;
    for (const ViewSettings& view : views) {
      if (view.antialias <= 1) continue;
      if (names.empty()) row.reason = at(fmt::format("cameras.{}.antialias", view.camera_name));
      names.push_back(fmt::format("{} {} x {}", view.camera_name, view.antialias, view.antialias));
    }
    row.on = !names.empty();
    row.reason =
        row.on ? fmt::format("{}: {}", row.reason, fmt::join(names, ", ")) : "no camera has `antialias` above 1";
    rows.push_back(std::move(row));
  }

  /// @param key in the map's `effects`; empty: only the scene switches it
  void called(Feature feature, std::string effect, std::string_view words, const std::string& key, std::string cost) {
    EffectRow row{"rendering",    std::move(effect), false, "", key.empty() ? "the scene" : "map effects." + key,
                  std::move(cost)};
    const Call* call = choice.calls.find(feature);
    const Call* unchanged = written.find(feature);
    if (call != nullptr) {
      row.on = true;
      row.reason = fmt::format("{}: {}", call->place(), call->word);
    } else if (unchanged != nullptr) {
      row.reason = fmt::format("{}: switched off; {}: {}", key.empty() ? "" : at("map.effects." + key),
                               unchanged->place(), unchanged->word);
    } else if (!choice.calls.unread.empty()) {
      // An include that could not be read may use the effect, and it is rendered then.
      row.on = true;
      row.reason = choice.calls.unread.front();
    } else {
      row.reason = fmt::format("no {} in {}", words, place.scene.string());
    }
    rows.push_back(std::move(row));
  }

  // ---- camera

  struct CameraRow {
    std::string effect;
    std::string key;
    bool (*is_on)(const CameraEffects&);
    std::string cost;
  };

  void camera() {
    int most = 0;
    for (const ViewSettings& view : views) {
      if (takes_time(view.effects)) most = std::max(most, view.effects.shutter_samples);
    }
    const std::string images = most == 0 ? "n images for one" : fmt::format("{} images for one", most);
    const std::vector<CameraRow> stages{
        {"shot noise", "full_well_electrons", [](auto& e) { return e.full_well_electrons > 0; }, "random numbers"},
        {"read noise", "read_noise_electrons", [](auto& e) { return e.read_noise_electrons > 0; }, "random numbers"},
        {"exposure and gain", "gain", [](auto& e) { return e.gain != 1; }, "a product per value"},
        {"vignetting", "vignetting", [](auto& e) { return e.vignetting > 0; }, "a product per value"},
        {"colour of the lamps", "colour_gain", [](auto& e) { return !e.colour_gain.empty(); }, "a product per value"},
        {"flickering lamps", "flicker", [](auto& e) { return e.flicker > 0; }, "a product per value"},
        {"defocus", "defocus_px", [](auto& e) { return e.defocus_px > 0; }, "a filter"},
        {"motion blur", "exposure_time_s", [](auto& e) { return e.exposure_time_s > 0; }, images},
        {"rolling shutter", "readout_s", [](auto& e) { return e.readout_s > 0; }, images},
        {"lens distortion", "distortion", [](auto& e) { return !e.distortion.empty(); }, "a look-up per pixel"},
        {"JPEG", "jpeg_quality", [](auto& e) { return e.jpeg_quality > 0; }, "compression"},
        {"dropped frames", "drop_probability", [](auto& e) { return e.drop_probability > 0; }, "none"},
        {"late frames", "late_probability", [](auto& e) { return e.late_probability > 0; }, "none"},
        {"late stamps", "stamp_late_s", [](auto& e) { return e.stamp_late_s > 0; }, "none"}};
    for (const auto& [effect, key, is_on, cost] : stages) {
      EffectRow row{"camera", effect, false, "", "robot effects.camera", cost};
      std::vector<std::string> names;
      for (const ViewSettings& view : views) {
        if (!is_on(view.effects)) continue;
        if (names.empty()) {
          const std::string own = fmt::format("cameras.{}.effects.{}", view.camera_name, key);
          row.reason = at(places.contains(own) ? own : "effects.camera." + key);
        }
        names.push_back(view.camera_name);
      }
      row.on = !names.empty();
      row.reason = row.on ? fmt::format("{}: {} of {}", row.reason, key, fmt::join(names, ", "))
                          : fmt::format("no `{}` in effects.camera", key);
      rows.push_back(std::move(row));
    }
  }

  // ---- motion

  void motion() {
    const WheelSettings& wheels = session.body.wheels;
    of_robot("wheel slip", "effects.slip", wheels.slip > 0, fmt::format("{} of the way", wheels.slip));
    of_robot("encoder counts", "effects.encoder_counts_per_turn", wheels.encoder_counts_per_turn > 0,
             fmt::format("{} a turn", wheels.encoder_counts_per_turn));
    of_robot("actuator lag", "effects.motor_lag_s", wheels.lag_s > 0, fmt::format("{} s", wheels.lag_s));

    const auto& physics = session.body.physics;
    std::string key = "effects.mass_kg";
    for (const char* other : {"effects.wheel_friction", "effects.body_friction"}) {
      if (!places.contains(key)) key = other;
    }
    rows.push_back(
        {"motion", "mass and friction", physics.has_value(),
         physics ? fmt::format("{}: {} kg", at(key), physics->mass_kg) : "no `mass_kg` or friction in effects",
         "robot effects", "an engine's steps"});

    const bool surrounded = place.walls || !place.solids.empty() || !place.moving.empty();
    const bool has_body = session.body.radius_m > 0;
    rows.push_back({"motion", "contact", has_body && surrounded,
                    !surrounded ? "no walls, obstacles or moving things in the map"
                    : !has_body ? "no `body.radius_m` in the robot file"
                                : fmt::format("{}: radius {} m", at("body.radius_m"), session.body.radius_m),
                    "robot body.radius_m", "a few tests a step"});

    std::vector<std::string> names;
    for (const MovingThing& thing : place.moving) names.push_back(thing.name);
    rows.push_back(
        {"motion", "moving things", !names.empty(),
         names.empty() ? "no `moving` in the map" : fmt::format("{}: {}", at("map.moving"), fmt::join(names, ", ")),
         "map moving", "none"});
  }

  void of_robot(std::string effect, const std::string& key, bool on, const std::string& value) {
    const std::string word = key.substr(key.rfind('.') + 1);
    rows.push_back({"motion", std::move(effect), on,
                    on ? fmt::format("{}: {}", at(key), value) : fmt::format("no `{}` above 0 in effects", word),
                    "robot effects", "none"});
  }

  /// Returns the file position of a key; the key itself if the position is unknown.
  [[nodiscard]] std::string at(const std::string& key) const {
    const auto found = places.find(key);
    return found == places.end() ? key : found->second;
  }
};

}  // namespace

Result<std::vector<EffectRow>> effect_table(const PlaceSettings& place, const SessionSettings& session,
                                            const std::vector<ViewSettings>& views, const KeyPlaces& places) {
  const auto scene = Scene::read(place.scene);
  if (!scene) return scene.error();
  const SceneAccess access(place.scene, place.scene_paths);
  const auto choice = choose_rendering(*scene, place.switches, access);
  if (!choice) return choice.error();
  const SceneCalls written = find_calls(*scene, access);
  return Table{place, session, views, places, written, *choice}.run();
}

}  // namespace twocone::sim_povray
