// SPDX-License-Identifier: Apache-2.0
#include "apps/config/robot_file.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>
#include <boost/algorithm/string.hpp>

#include "apps/config/keys/robot_keys.h"
#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"

namespace twocone::config {
namespace {

std::string in_one_line(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetMapFormat(YAML::Flow);
  emitter.SetSeqFormat(YAML::Flow);
  emitter << node;
  return emitter.c_str();
}

bool is_zero(const std::array<double, 2>& pair) { return pair[0] == 0 && pair[1] == 0; }

bool has_same_lens(const RigView& a, const RigView& b) {
  return a.distortion == b.distortion && a.distortion_focal_px == b.distortion_focal_px &&
         a.distortion_principal_px == b.distortion_principal_px;
}

YAML::Node mirror_of(const RigView& view) {
  YAML::Node mirror;
  mirror.SetStyle(YAML::EmitterStyle::Flow);
  mirror["type"] = "cone";
  mirror["apex_rad"] = text_of(view.apex_rad);
  return mirror;
}

/// Returns the keys of one mirror. @param info_path `camera_info` as it will be written; empty: it no longer applies
YAML::Node view_of(const Rig& rig, std::string_view mirror, const std::string& info_path) {
  const RigView& view = mirror == "lower" ? rig.lower : rig.upper;
  YAML::Node node(YAML::NodeType::Map);
  const auto put = [&](const char* key, const auto& value) {
    const bool is_missing = std::ranges::find(rig.missing, fmt::format("{}.{}", mirror, key)) != rig.missing.end();
    if (!is_missing) node[key] = value;
  };
  put("centre_px", list_of(view.centre_px));
  put("rim_radius_px", text_of(view.rim_radius_px));
  put("azimuth_rad", text_of(view.azimuth_rad));
  if (view.mirrored) node["mirrored"] = true;
  if (!is_zero(view.tilt_rad)) node["tilt_rad"] = list_of(view.tilt_rad);
  if (!is_zero(view.axis_offset_m)) node["axis_offset_m"] = list_of(view.axis_offset_m);
  if (view.late_s != 0) node["late_s"] = text_of(view.late_s);
  if (view.readout_s != 0) node["readout_s"] = text_of(view.readout_s);
  if (!info_path.empty()) {
    node["camera_info"] = info_path;
  } else if (!view.distortion.empty()) {
    node["distortion"] = list_of(view.distortion);
    if (view.distortion_focal_px) node["distortion_focal_px"] = list_of(*view.distortion_focal_px);
    if (view.distortion_principal_px) node["distortion_principal_px"] = list_of(*view.distortion_principal_px);
  }
  return node;
}

/// Returns the path `written` of `original` as it must be written in `new_file`.
std::string moved(const std::filesystem::path& written, const std::filesystem::path& original,
                  const std::filesystem::path& new_file) {
  if (written.is_absolute()) return written.string();
  return relative_to(new_file, std::filesystem::absolute(resolve(written, original)));
}

/// Returns the `camera_info` of a mirror as it is written in `original`.
std::string info_path_of(const YAML::Node& rig, const char* mirror) {
  constexpr const char* kKey = "camera_info";
  if (rig[mirror] && rig[mirror][kKey]) return rig[mirror][kKey].as<std::string>();
  return rig[kKey] ? rig[kKey].as<std::string>() : std::string();
}

YAML::Node rig_of(const Rig& rig, const std::string& lower_info, const std::string& upper_info) {
  YAML::Node node;
  YAML::Node lower = view_of(rig, "lower", lower_info);
  YAML::Node upper = view_of(rig, "upper", upper_info);
  const auto put = [&](const char* key, bool is_common, const auto& value_of) {
    if (is_common) {
      node[key] = value_of(rig.lower);
    } else {
      lower[key] = value_of(rig.lower);
      upper[key] = value_of(rig.upper);
    }
  };
  put("mirror", rig.lower.apex_rad == rig.upper.apex_rad, mirror_of);
  put("mirror_radius_m", rig.lower.mirror_radius_m == rig.upper.mirror_radius_m,
      [](const RigView& view) { return text_of(view.mirror_radius_m); });
  put("lens_to_tip_m", rig.lower.lens_to_tip_m == rig.upper.lens_to_tip_m,
      [](const RigView& view) { return text_of(view.lens_to_tip_m); });
  node["mirror_separation_m"] = text_of(rig.mirror_separation_m);
  node["lens_height_m"] = text_of(rig.lens_height_m);
  node["lower"] = lower;
  node["upper"] = upper;
  if (rig.sigma) node["sigma"] = sigma_of(*rig.sigma);
  return node;
}

/// Changes only those values of a camera that differ from `read`.
void set_camera(YAML::Node camera, const drivers::CameraPart& changed, const drivers::CameraPart& read) {
  const CameraSettings &now = changed.settings, &then = read.settings;
  if (now.width_px != then.width_px) camera["width_px"] = now.width_px;
  if (now.height_px != then.height_px) camera["height_px"] = now.height_px;
  if (now.rate_hz != then.rate_hz) camera["rate_hz"] = text_of(now.rate_hz);
  if (changed.antialias == read.antialias) return;
  camera.remove("antialias");
  if (changed.antialias != drivers::CameraPart{}.antialias) camera["antialias"] = changed.antialias;
}

/// Gives a camera that is a YAML alias of another one its own text. Otherwise one change would alter both.
void part_cameras(YAML::Node& cameras, const std::vector<drivers::OtherCamera>& others) {
  const auto part = [&](const std::string& name, const std::string& from) {
    if (!cameras[name].is(cameras[from])) return;
    const YAML::Node own = YAML::Clone(cameras[name]);
    cameras.remove(name);
    cameras[name] = own;
  };
  part("upper", "lower");
  for (const drivers::OtherCamera& other : others) {
    part(other.name, "lower");
    part(other.name, "upper");
  }
}

}  // namespace

std::vector<KeyChange> exchange_cameras(const Robot& robot) {
  const YAML::Node node = with_changes(with_present_names(load_yaml(robot.file)), robot.changes);
  const YAML::Node& cameras = node["cameras"];
  return {{"cameras.lower", in_one_line(cameras["upper"])}, {"cameras.upper", in_one_line(cameras["lower"])}};
}

KeyChange change_to(const RigSigma& sigma) { return {"rig.sigma", in_one_line(sigma_of(sigma))}; }

std::string comments(const std::vector<std::string>& lines) {
  std::string text;
  for (std::string line : lines) {
    boost::replace_all(line, "\r", "\n");
    boost::replace_all(line, "\n", "\n# ");
    text += (line.empty() ? "#" : "# ") + line + '\n';
  }
  return text;
}

std::string robot_text(const std::filesystem::path& file, const std::filesystem::path& new_file, const Robot& changed,
                       const std::vector<std::string>& header_lines) {
  YAML::Node node = with_changes(with_present_names(load_yaml(file)), changed.changes);
  const Robot robot = parse_robot(node, file);
  node["map"] = moved(node["map"].as<std::string>(), file, new_file);
  const auto info = [&](const char* mirror, RigView Rig::*view, drivers::CameraPart Robot::*camera) {
    const RigView& now = changed.rig.*view;
    const RigView& then = robot.rig.*view;
    const bool is_that_camera = (changed.*camera).settings.width_px == (robot.*camera).settings.width_px &&
                                (changed.*camera).settings.height_px == (robot.*camera).settings.height_px;
    const bool is_of_the_file = !now.camera_info.empty() && now.camera_info == then.camera_info;
    if (!is_of_the_file || !has_same_lens(now, then) || !is_that_camera) return std::string();
    return moved(info_path_of(node["rig"], mirror), file, new_file);
  };
  node["rig"] =
      rig_of(changed.rig, info("lower", &Rig::lower, &Robot::lower), info("upper", &Rig::upper, &Robot::upper));
  if (!changed.rig.calibration.empty()) {
    node["rig"]["calibration"] = relative_to(new_file, std::filesystem::absolute(changed.rig.calibration));
  }
  if (changed.map != robot.map) node["map"] = relative_to(new_file, std::filesystem::absolute(changed.map));
  node["drive"]["wheel_separation_m"] = text_of(changed.drive.wheel_separation_m);
  node["drive"]["wheel_radius_m"] = text_of(changed.drive.wheel_radius_m);
  node["drive"].remove("sigma");
  if (changed.drive.sigma) node["drive"]["sigma"] = sigma_of(*changed.drive.sigma);
  YAML::Node cameras = node["cameras"];
  part_cameras(cameras, robot.others);
  set_camera(cameras["lower"], changed.lower, robot.lower);
  set_camera(cameras["upper"], changed.upper, robot.upper);
  for (const drivers::OtherCamera& other : robot.others) {
    drivers::CameraPart with_rate = other.part;
    with_rate.settings.rate_hz = changed.lower.settings.rate_hz;
    set_camera(cameras[other.name], with_rate, other.part);
  }
  set_camera_effects(node, "lower", changed.lower, robot.lower, file);
  set_camera_effects(node, "upper", changed.upper, robot.upper, file);
  set_effects(node, changed.effects, robot.effects);
  if (changed.estimator != robot.estimator) set_estimator(node, changed.estimator);

  std::string text = "# SPDX-License-Identifier: Apache-2.0\n" + comments(header_lines);
  text += comments({fmt::format("From {}, whose comments are not kept.", file.filename().string())});
  YAML::Emitter emitter;
  emitter << node;
  text += fmt::format("{}\n", emitter.c_str());
  (void)parse_robot(parse_yaml(text, new_file), new_file);  // never return text that read_robot rejects
  return text;
}

}  // namespace twocone::config
