// SPDX-License-Identifier: Apache-2.0
#include <cctype>
#include <iterator>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/new_scene/new_scene.h"
#include "apps/runlog/storage/disk.h"
#include "drivers/sim_povray/scene_geometry.h"

namespace twocone::new_scene {
namespace {

/// The robot, in metres about its axis on the floor: x forward, y up. Everything about it is stated, because a scene's
/// #default may be anything.
constexpr const char* kRobot = R"(
// ---- the robot, and what was added for it
#version 3.7;
#declare New_Mirror = texture { pigment { color rgb 0 } finish { ambient 0 diffuse 0 reflection 0.9 } }
#declare New_Dark = texture { pigment { color rgb 0.09 } finish { ambient 0.3 diffuse 0.6 reflection 0 } }
#declare New_Pale = texture { pigment { color rgb 0.60 } finish { ambient 0.3 diffuse 0.6 reflection 0 } }
#macro New_View(Lens)             // a camera that looks up at a cone mirror, and the arm that holds it
  cylinder { (Lens - 0.055)*y (Lens - 0.005)*y 0.023 texture { New_Dark } }
  cylinder { <-0.13, Lens - 0.06, 0> <0, Lens - 0.06, 0> 0.005 texture { New_Pale } }
  cone { (Lens + 0.12)*y, 0 (Lens + 0.18)*y, 0.06 texture { New_Mirror } }
  cylinder { (Lens + 0.18)*y (Lens + 0.19)*y 0.06 texture { New_Dark } }
#end
#declare New_Robot = union {
  cylinder { 0.05*y 0.18*y 0.19 texture { New_Dark } }
  cylinder { <0, 0.05, -0.16> <0, 0.05, -0.14> 0.05 texture { New_Pale } }
  cylinder { <0, 0.05, 0.14> <0, 0.05, 0.16> 0.05 texture { New_Pale } }
  cylinder { <-0.13, 0.18, 0> <-0.13, 0.79, 0> 0.004 texture { New_Pale } }
  New_View(0.25)
  New_View(0.55)
  cylinder { <-0.13, 0.775, 0> <0, 0.775, 0> 0.005 texture { New_Pale } }
  cylinder { 0.74*y 0.775*y 0.008 texture { New_Pale } }
}
)";

/// The text of a file.
class Text {
 public:
  template <typename... Values>
  void print(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }
  [[nodiscard]] const std::string& str() const { return text_; }

 private:
  std::string text_;
};

/// Returns the text as a quoted YAML scalar.
std::string quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

std::string origin_of(const FoundLandmark& found) { return found.place.empty() ? "added" : found.place; }

void write_wrapper(const Room& room, const std::filesystem::path& path) {
  const auto copy = sim_povray::text_without_robot(room.scene);
  if (!copy) throw NoPlace("{}", copy.error().message);
  Text file;
  if (copy->empty()) {
    file.print("// {}: a robot in a scene, by `twocone new`.\n// SCALE  1 POV-Ray unit = {} m\n",
               path.filename().string(), room.floor.unit_m);
    file.print("// The scene is unchanged; its own camera is not used, because others follow.\n\n");
    file.print("#include \"{}\"\n", room.scene.string());
  } else {
    // A scene with a robot is copied without it.
    file.print("{}\n// ---- above: a copy of {} without its robot\n", *copy, room.scene.string());
  }
  file.print("{}", kRobot);
  const double per_m = 1 / room.floor.unit_m;
  const std::string placed = fmt::format("scale {:.12g} translate <{:.12g}, {:.12g}, {:.12g}>", per_m,
                                         room.start.x_m * per_m, room.floor.units, room.start.y_m * per_m);
  file.print("\nunion {{\n  //*PMName robot\n  object {{ New_Robot }}\n  {}\n}}\n", placed);
  for (const FoundLandmark& found : room.landmarks) {
    if (!found.place.empty()) continue;
    const Landmark& l = found.landmark;
    // It glows, so that it has its colour in any light.
    file.print(
        "cylinder {{ <{0:.12g}, {1:.12g}, {2:.12g}> <{0:.12g}, {3:.12g}, {2:.12g}> {4:.12g}   // {8}\n"
        "  texture {{ pigment {{ color rgb <{5}, {6}, {7}> }} finish {{ ambient 0 diffuse 0 emission 0.8 reflection 0 "
        "}} }}\n"
        "  no_shadow\n}}\n",
        l.x_m * per_m, room.floor.units, l.y_m * per_m, room.floor.units + l.top_m * per_m, l.radius_m * per_m,
        l.colour[0], l.colour[1], l.colour[2], l.name);
  }
  for (const auto& [name, lens_m] : {std::pair{"lower", 0.25}, {"upper", 0.55}}) {
    file.print(
        "camera {{\n  //*PMName {}\n  perspective location {}*y direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>\n"
        "  {}\n}}\n",
        name, lens_m, placed);
  }
  runlog::write_whole(path, file.str());
}

void write_map(const Room& room, const RoomSettings& settings, const NewFiles& files) {
  Text file;
  file.print("# Map of {}, by `twocone new`. The floor is {}, at y = {} POV-Ray units.\n",
             files.wrapper.filename().string(), room.floor.place, room.floor.units);
  file.print("scene: {}\nscene_paths: [{}", quoted(files.wrapper.filename()), quoted(room.scene.parent_path()));
  for (const auto& folder : settings.scene_paths) {
    file.print(", {}", quoted(std::filesystem::absolute(folder).lexically_normal()));
  }
  file.print("]\n# {}\nunit_m: {:.12g}\n", room.floor.why_unit, room.floor.unit_m);
  file.print("bounds_m: {{x: [{:.3f}, {:.3f}], y: [{:.3f}, {:.3f}]}}\nlandmark_sigma_m: 0\nlandmarks:\n",
             room.bounds.min_x_m, room.bounds.max_x_m, room.bounds.min_y_m, room.bounds.max_y_m);
  for (const FoundLandmark& found : room.landmarks) {
    const Landmark& l = found.landmark;
    file.print(
        "  - {{name: {}, colour: [{:.4g}, {:.4g}, {:.4g}], x_m: {:.6f}, y_m: {:.6f}, radius_m: {:.6f}, "
        "top_m: {:.6f}}}  # {}\n",
        l.name, l.colour[0], l.colour[1], l.colour[2], l.x_m, l.y_m, l.radius_m, l.top_m, origin_of(found));
  }
  if (!room.obstacles.empty()) file.print("obstacles:\n");
  for (const FoundObstacle& found : room.obstacles) {
    std::string corners;
    for (const FloorPoint& p : found.corners) {
      corners += fmt::format("{}[{:.3f}, {:.3f}]", corners.empty() ? "" : ", ", p.x_m, p.y_m);
    }
    file.print("  - {{polygon_m: [{}]}}  # {}\n", corners, found.what);
  }
  runlog::write_whole(files.map, file.str());
}

void write_robot(const Room& room, const NewFiles& files) {
  Text file;
  file.print(
      "# The robot in {}, by `twocone new`. The lab's robot file explains the keys.\n#\n"
      "#   twocone run --robot {} --frames 4\n\n",
      files.wrapper.filename().string(), files.robot.string());
  file.print("name: {}\nmap: {}\nstart: {{x_m: {:.6f}, y_m: {:.6f}, heading_rad: 0.0}}\n", quoted(files.robot.stem()),
             quoted(files.map.filename()), room.start.x_m, room.start.y_m);
  file.print(R"(latency_frames: 4
body: {{radius_m: {}}}
drive: {{driver: sim_povray, wheel_separation_m: 0.30, wheel_radius_m: 0.05, max_speed_mps: 0.5, command_timeout_s: 0.5, sigma: 0}}
cameras:
  lower: {{driver: sim_povray, width_px: 640, height_px: 480, rate_hz: 15}}
  upper: {{driver: sim_povray, width_px: 640, height_px: 480, rate_hz: 15}}
rig:
  mirror: {{type: cone, apex_rad: 1.5707963267948966}}
  mirror_radius_m: 0.06
  lens_to_tip_m: 0.12
  mirror_separation_m: 0.30
  lens_height_m: 0.25
  sigma: 0
  lower: {{centre_px: [319.5, 239.5], rim_radius_px: 236.0, azimuth_rad: 0.0}}
  upper: {{centre_px: [319.5, 239.5], rim_radius_px: 236.0, azimuth_rad: 0.0}}
)",
             StandardRobot::kRadius_m);
  runlog::write_whole(files.robot, file.str());
}

}  // namespace

NewFiles files_for(const std::filesystem::path& scene, const std::filesystem::path& folder) {
  std::string name = scene.stem().string();
  // A robot's name must be fit for a folder, and a map's file is named after the scene.
  for (char& letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0 && letter != '-') letter = '_';
  }
  return {folder / (name + ".pov"), folder / (name + ".map.yaml"), folder / (name + ".yaml")};
}

void write_files(const Room& room, const RoomSettings& settings, const NewFiles& files) {
  runlog::make_folder(files.wrapper.parent_path());
  write_wrapper(room, files.wrapper);
  write_map(room, settings, files);
  write_robot(room, files);
}

}  // namespace twocone::new_scene
