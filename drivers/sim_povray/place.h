// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/render_settings.h"

namespace twocone::sim_povray {

using Outline = std::vector<FloorPoint>;  ///< corners of a simple polygon, at least three

/// An obstacle that stands on the floor and stops a robot.
struct Solid {
  std::string name;  ///< name in messages: "landmark red", "obstacle 3"
  std::variant<Disc, Outline> shape{};
};

/// An object that moves along a path by itself. It is at path_m[0] at time 0, faces along its path and moves at
/// constant speed. If it loops, it returns to the first point on a straight line; otherwise it stops at the last point.
/// The scene shows it at path_m[0], facing along the first segment, as the object `moving.NAME`.
struct MovingThing {
  std::string name;                  ///< without `moving.`
  std::vector<FloorPoint> path_m{};  ///< at least two points, no two neighbours equal
  double speed_mps = 0;              ///< > 0
  bool loop = false;
  double radius_m = 0;  ///< radius of the disc that stops a robot, > 0

  friend bool operator==(const MovingThing&, const MovingThing&) = default;
};

/// Rendering effects that the map switches off or changes, although the scene's text uses them.
struct SceneSwitches {
  bool shadows = true;
  bool area_lights = true;  ///< off: a point light at the area's centre
  bool photons = true;
  bool radiosity = true;
  bool media = true;                      ///< media and fog
  std::optional<int> reflection_depth{};  ///< replaces the scene's max_trace_level, 1 to 256

  friend bool operator==(const SceneSwitches&, const SceneSwitches&) = default;
};

/// A scene with everything in it except robots.
struct PlaceSettings {
  std::filesystem::path scene;  ///< a POV-Ray file
  /// Folders that the scene may read, with all their sub-folders, in addition to POV-Ray's libraries. The scene may not
  /// write any file. Empty: the scene's own folder.
  std::vector<std::filesystem::path> scene_paths{};
  double unit_m = 0.05;           ///< metres in one POV-Ray unit, > 0
  std::optional<Bounds> walls{};  ///< positions of the inner faces
  std::vector<Solid> solids{};
  std::vector<MovingThing> moving{};
  SceneSwitches switches{};
  RenderSettings render{};
};

/// @throws std::invalid_argument naming every bad field
void check(const PlaceSettings& settings);

}  // namespace twocone::sim_povray
