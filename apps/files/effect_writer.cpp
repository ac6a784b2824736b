// SPDX-License-Identifier: Apache-2.0
#include "apps/files/effect_writer.h"

#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/files/camera_effects.h"
#include "apps/files/file_error.h"
#include "apps/files/yaml_numbers.h"

namespace twocone::files {
namespace {

std::string value_of(double number) { return text_of(number); }
int value_of(int number) { return number; }
YAML::Node value_of(const std::vector<double>& numbers) { return list_of(numbers); }

/// A copy of the mapping, or a new one: what else has it by an alias must not change with it.
YAML::Node own_mapping(const YAML::Node& parent, const char* key) {
  const YAML::Node there = parent[key];
  return there && there.IsMap() ? YAML::Clone(there) : YAML::Node(YAML::NodeType::Map);
}

void replace(YAML::Node& parent, const char* key, const YAML::Node& mapping) {
  parent.remove(key);
  if (mapping.size() > 0) parent[key] = mapping;
}

/// What `effects.camera` makes of a camera that says nothing itself.
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
  // What other keys depend on is said even where it is as in common: without it they would be refused.
  const auto say = [&](const char* key, const auto& now, const auto& then) {
    if (now != then) node[key] = value_of(now);
  };
  const auto put = [&](const char* key, const auto& now, const auto& then, const auto& inherited) {
    if (now == then) return;
    node.remove(key);
    if (now != inherited) node[key] = value_of(now);
  };
  const sim_povray::CameraEffects& then = read.effects;
  const auto& [gain, full_well_electrons, read_noise_electrons, vignetting, defocus_px, exposure_s, readout_s,
               exposures, distortion, distortion_focal_px, drop_probability, late_probability, stamp_late_s] =
      changed.effects;
  put("gain", gain, then.gain, common.gain);
  put("full_well_electrons", full_well_electrons, then.full_well_electrons, common.full_well_electrons);
  put("read_noise_electrons", read_noise_electrons, then.read_noise_electrons, common.read_noise_electrons);
  put("vignetting", vignetting, then.vignetting, common.vignetting);
  put("defocus_px", defocus_px, then.defocus_px, common.defocus_px);
  say("exposure_s", exposure_s, then.exposure_s);
  say("readout_s", readout_s, then.readout_s);
  put("exposures", exposures, then.exposures, common.exposures);
  if (has("exposures") && exposure_s == 0 && readout_s == 0) node["exposure_s"] = 0;
  say("distortion", distortion, then.distortion);
  put("distortion_focal_px", distortion_focal_px, then.distortion_focal_px, common.distortion_focal_px);
  if (has("distortion_focal_px") && distortion.empty()) node["distortion"] = list_of({});
  put("drop_probability", drop_probability, then.drop_probability, common.drop_probability);
  put("late_probability", late_probability, then.late_probability, common.late_probability);
  put("stamp_late_s", stamp_late_s, then.stamp_late_s, common.stamp_late_s);
  replace(camera, "effects", node);
}

}  // namespace twocone::files
