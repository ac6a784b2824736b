// SPDX-License-Identifier: Apache-2.0
#include "apps/config/keys/effect_writer.h"

#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/config/keys/camera_effects.h"
#include "apps/config/yaml/file_error.h"
#include "apps/config/yaml/yaml_numbers.h"

namespace twocone::config {
namespace {

std::string value_of(double number) { return text_of(number); }
int value_of(int number) { return number; }
YAML::Node value_of(const std::vector<double>& numbers) { return list_of(numbers); }

/// Returns a copy of the mapping, or a new one. A YAML alias of the mapping must not change with it.
YAML::Node own_mapping(const YAML::Node& parent, const char* key) {
  const YAML::Node there = parent[key];
  return there && there.IsMap() ? YAML::Clone(there) : YAML::Node(YAML::NodeType::Map);
}

void replace(YAML::Node& parent, const char* key, const YAML::Node& mapping) {
  parent.remove(key);
  if (mapping.size() > 0) parent[key] = mapping;
}

/// Returns the effects of a camera that sets none itself, which come from `effects.camera`.
sim_povray::CameraEffects common_effects(const YAML::Node& robot, const std::filesystem::path& file) {
  sim_povray::CameraEffects common;
  Reading reading(robot, file);
  Section* effects = reading.root().section("effects", "", Need::kOptional);
  Section* camera = effects != nullptr ? effects->section("camera", "", Need::kOptional) : nullptr;
  if (camera != nullptr) read_camera_effects(*camera, common);
  return common;
}

}  // namespace

void set_effects(YAML::Node& robot, const Effects& changed, const Effects& read) {
  if (changed == read) return;
  const auto& [slip, counts, lag_s, separation_m, radius_m, mass_kg, wheel_friction, body_friction] = changed;
  const Effects defaults;
  YAML::Node node = own_mapping(robot, "effects");
  const auto put = [&](const char* key, const auto& now, const auto& then, const auto& by_default) {
    if (now == then) return;
    node.remove(key);
    if (now != by_default) node[key] = value_of(now);
  };
  const auto put_optional = [&](const char* key, const std::optional<double>& now, const std::optional<double>& then) {
    if (now == then) return;
    node.remove(key);
    if (now) node[key] = text_of(*now);
  };
  put("slip", slip, read.slip, defaults.slip);
  put("encoder_counts_per_turn", counts, read.encoder_counts_per_turn, defaults.encoder_counts_per_turn);
  put("motor_lag_s", lag_s, read.motor_lag_s, defaults.motor_lag_s);
  put_optional("wheel_separation_m", separation_m, read.wheel_separation_m);
  put_optional("wheel_radius_m", radius_m, read.wheel_radius_m);
  put_optional("mass_kg", mass_kg, read.mass_kg);
  put_optional("wheel_friction", wheel_friction, read.wheel_friction);
  put_optional("body_friction", body_friction, read.body_friction);
  replace(robot, "effects", node);
}

void set_camera_effects(YAML::Node& robot, const std::string& name, const CameraEntry& changed, const CameraEntry& read,
                        const std::filesystem::path& file) {
  if (changed.effects == read.effects) return;
  if (read.driver != drivers::kSimPovray) {
    throw FileError(
        fmt::format("{}: cameras.{}.effects cannot be changed, must be absent: driver {} has no such setting",
                    file.string(), name, read.driver));
  }
  const sim_povray::CameraEffects common = common_effects(robot, file);
  YAML::Node camera = robot["cameras"][name];
  YAML::Node node = own_mapping(camera, "effects");
  const auto has = [&](const char* key) { return bool(std::as_const(node)[key]); };
  // A key on which others depend is written even if it equals the common value. Without it the reader would reject
  // them.
  const auto put_always = [&](const char* key, const auto& now, const auto& then) {
    if (now != then) node[key] = value_of(now);
  };
  const auto put = [&](const char* key, const auto& now, const auto& then, const auto& inherited) {
    if (now == then) return;
    node.remove(key);
    if (now != inherited) node[key] = value_of(now);
  };
  const sim_povray::CameraEffects& then = read.effects;
  const auto& [gain, full_well_electrons, read_noise_electrons, vignetting, defocus_px, exposure_time_s, readout_s,
               shutter_samples, distortion, distortion_focal_px, drop_probability, late_probability, stamp_late_s] =
      changed.effects;
  put("gain", gain, then.gain, common.gain);
  put("full_well_electrons", full_well_electrons, then.full_well_electrons, common.full_well_electrons);
  put("read_noise_electrons", read_noise_electrons, then.read_noise_electrons, common.read_noise_electrons);
  put("vignetting", vignetting, then.vignetting, common.vignetting);
  put("defocus_px", defocus_px, then.defocus_px, common.defocus_px);
  put_always("exposure_time_s", exposure_time_s, then.exposure_time_s);
  put_always("readout_s", readout_s, then.readout_s);
  put("shutter_samples", shutter_samples, then.shutter_samples, common.shutter_samples);
  if (has("shutter_samples") && exposure_time_s == 0 && readout_s == 0) node["exposure_time_s"] = 0;
  put_always("distortion", distortion, then.distortion);
  put("distortion_focal_px", distortion_focal_px, then.distortion_focal_px, common.distortion_focal_px);
  if (has("distortion_focal_px") && distortion.empty()) node["distortion"] = list_of({});
  put("drop_probability", drop_probability, then.drop_probability, common.drop_probability);
  put("late_probability", late_probability, then.late_probability, common.late_probability);
  put("stamp_late_s", stamp_late_s, then.stamp_late_s, common.stamp_late_s);
  replace(camera, "effects", node);
}

}  // namespace twocone::config
