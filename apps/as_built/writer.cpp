// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/as_built/as_built.h"
#include "apps/runlog/storage/disk.h"
#include "drivers/sim_povray/scene_geometry.h"

namespace twocone::as_built {
namespace {

/// A scene that defines it draws no landmarks, so that they can be put elsewhere.
constexpr const char* kWithoutLandmarks = "Landmarks_Elsewhere";

/// Returns the text of the plan's scene without its robot, and with the declaration that leaves its landmarks out. Line
/// numbers do not change: the declaration stands behind `#version`, which POV-Ray requires to be the first statement.
std::string room_text(const std::filesystem::path& scene) {
  const auto text = sim_povray::text_without_robot(scene);
  if (!text) throw BadPlan("{}", text.error().message);
  if (text->empty()) throw BadPlan("{}: there is no robot, must be a scene with the robot of the plan", scene.string());
  std::string room = *text;
  const std::size_t version = room.find("#version");
  const std::size_t end = version == std::string::npos ? std::string::npos : room.find(';', version);
  if (end == std::string::npos) throw BadPlan("{}: there is no `#version 3.7;`, which must come first", scene.string());
  room.insert(end + 1, fmt::format(" #declare {} = 1;", kWithoutLandmarks));
  return room;
}

/// Requires that none of the plan's landmarks still stands in the copied part of the scene.
void check_without_landmarks(const std::filesystem::path& scene, const config::Map& plan, int copied_lines) {
  const auto geometry =
      sim_povray::SceneGeometry::read({.scene = scene, .scene_paths = plan.scene_paths, .unit_m = plan.unit_m});
  if (!geometry) throw BadPlan("{}", geometry.error().message);
  for (const sim_povray::SceneCylinder& cylinder : geometry->upright_cylinders()) {
    const sim_povray::SceneObject& object = geometry->objects()[std::size_t(cylinder.object)];
    if (object.file == scene.string() && object.line > copied_lines) continue;
    for (const Landmark& landmark : plan.landmarks) {
      const double apart_m = std::hypot(cylinder.x_m - landmark.x_m, cylinder.y_m - landmark.y_m);
      if (apart_m > landmark.radius_m || cylinder.top_m < landmark.top_m / 2) continue;
      throw BadPlan(
          "{}:{}: landmark {} cannot be moved; in the plan's scene it must stand between `#ifndef ({})` and "
          "`#end`",
          plan.scene->string(), object.line, landmark.name, kWithoutLandmarks);
    }
  }
}

/// Returns what is true and nowhere stated in the robot files.
std::vector<std::string> flaws_of(const AsBuilt& drawn) {
  std::vector<std::string> lines;
  for (const auto& [name, flaws] : {std::pair("lower", &drawn.lower), {"upper", &drawn.upper}}) {
    const auto& [x_m, y_m] = flaws->lens_off_axis_m;
    if (x_m != 0 || y_m != 0) lines.push_back(fmt::format("{} lens: off its axis by ({}, {}) m", name, x_m, y_m));
    if (flaws->bulge_m != 0) lines.push_back(fmt::format("{} mirror: bulges by {} m", name, flaws->bulge_m));
  }
  for (std::size_t i = 0; i < drawn.landmarks.size(); ++i) {
    const LandmarkFlaws& flaws = drawn.landmarks[i];
    const std::string& name = drawn.built_map.landmarks[i].name;
    if (flaws.lean_rad != 0) {
      lines.push_back(
          fmt::format("landmark {}: leans by {} rad towards {} rad", name, flaws.lean_rad, flaws.direction_rad));
    }
    if (flaws.oval != 0) {
      lines.push_back(
          fmt::format("landmark {}: oval by {}, longest along {} rad", name, flaws.oval, flaws.direction_rad));
    }
  }
  return lines;
}

/// Returns the robot's file, which names its map by `map`, a file in the same folder.
std::string robot_text(config::Robot robot, const std::filesystem::path& file, const std::filesystem::path& map,
                       const std::vector<std::string>& lines) {
  robot.map = map;
  return config::robot_text(robot.file, file, robot, lines);
}

}  // namespace

Files files_in(const std::filesystem::path& folder) {
  return {folder / "scene.pov", folder / "built.map.yaml", folder / "built.yaml", folder / "believed.map.yaml",
          folder / "believed.yaml"};
}

Files write(const AsBuilt& drawn, const std::filesystem::path& folder) {
  const config::Robot& plan = drawn.believed;
  if (!drawn.built_map.scene) {
    throw BadPlan("{}: scene is missing: the POV-Ray file, a copy of which gets the robot",
                  drawn.built_map.file.string());
  }
  Files files = files_in(folder);
  const std::string room = room_text(*drawn.built_map.scene);
  std::string scene = room + fmt::format(
                                 "\n// ---- above: a copy of {} without robot and landmarks\n// {} as built, "
                                 "seed {}, by `twocone as-built`\n",
                                 drawn.built_map.scene->filename().string(), plan.name, drawn.seed);
  for (const std::string& line : flaws_of(drawn)) scene += "// " + line + '\n';
  scene += scene_text(drawn);

  config::Map built_map = drawn.built_map, believed_map = drawn.believed_map;
  built_map.scene = believed_map.scene = files.scene.filename();
  const std::string what = fmt::format("{} as built, seed {}", plan.name, drawn.seed);
  const std::vector<std::string> truth{
      what + ", by `twocone as-built`: the truth, as far as a file can state it. believed.yaml is what its builder",
      "wrote down. Both show the same scene by the same effects."};
  const std::vector<std::string> belief{
      what + ", by `twocone as-built`: what its builder wrote down, and how sure of it he is. built.yaml is the truth.",
      "`effects:` belong to the simulated world; no robot knows them."};
  runlog::make_folder(folder);
  runlog::write_whole(files.scene, scene);
  check_without_landmarks(files.scene, drawn.believed_map, int(std::ranges::count(room, '\n')));
  runlog::write_whole(files.built_map, config::map_text(drawn.built_map.file, files.built_map, built_map, truth));
  runlog::write_whole(files.believed_map,
                      config::map_text(drawn.believed_map.file, files.believed_map, believed_map, belief));
  runlog::write_whole(files.built, robot_text(drawn.built, files.built, files.built_map, truth));
  runlog::write_whole(files.believed, robot_text(drawn.believed, files.believed, files.believed_map, belief));
  return files;
}

}  // namespace twocone::as_built
