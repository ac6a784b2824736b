// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace YAML {
class Node;
}

namespace twocone::files {

/// An upright cylinder at a known place. World frame, metres.
struct Landmark {
  std::string name;                ///< not empty, unlike the others'
  std::array<double, 3> colour{};  ///< linear rgb, each in [0, 1]; its hue tells the landmark, so it must have one
  double x_m = 0;                  ///< of the axis, inside the bounds
  double y_m = 0;
  double radius_m = 0;  ///< > 0
  double top_m = 0;     ///< height of the flat top above the floor, > 0

  friend bool operator==(const Landmark&, const Landmark&) = default;
};

struct Point {
  double x_m = 0;
  double y_m = 0;

  friend bool operator==(const Point&, const Point&) = default;
};
struct Circle {
  Point centre;
  double radius_m = 0;  ///< > 0

  friend bool operator==(const Circle&, const Circle&) = default;
};
using Polygon = std::vector<Point>;  ///< at least three corners, not crossing itself
using Obstacle = std::variant<Polygon, Circle>;

/// A rectangle along the world's axes, min < max.
struct Bounds {
  double min_x_m = 0, max_x_m = 0;
  double min_y_m = 0, max_y_m = 0;

  friend bool operator==(const Bounds&, const Bounds&) = default;
};

/// Something that goes along a path by itself, at constant speed; in simulation, the scene's object `moving.NAME`.
struct Moving {
  std::string name;         ///< letters, digits, _; unlike the others'
  std::vector<Point> path;  ///< at least two points inside the bounds, no two neighbours equal
  double speed_mps = 0;     ///< > 0
  bool loop = false;        ///< from the last point straight to the first; else it stands at the last
  double radius_m = 0;      ///< > 0

  friend bool operator==(const Moving&, const Moving&) = default;
};

/// What of the scene's rendering is switched off (`effects:`), though its text calls for it.
struct SceneEffects {
  bool shadows = true;
  bool area_lights = true;
  bool photons = true;
  bool radiosity = true;
  bool media = true;
  std::optional<int> reflection_depth{};  ///< 1 to 256, in place of the scene's max_trace_level

  friend bool operator==(const SceneEffects&, const SceneEffects&) = default;
};

/// What a robot may know of a place (scenes/lab.map.yaml). Ground truth is not in it.
struct Map {
  std::filesystem::path file;                  ///< as it was asked for
  std::optional<std::filesystem::path> scene;  ///< resolved against the file's folder; none for a real room
  /// Folders that the scene may read, absolute: the map file's own, then those of `scene_paths:`. Empty: the scene's
  /// own. Simulation only.
  std::vector<std::filesystem::path> scene_paths{};
  double unit_m = 0.05;  ///< one POV-Ray unit, > 0; a file with a scene must say it
  Bounds bounds;         ///< the walls
  std::vector<Landmark> landmarks;
  std::vector<Obstacle> obstacles;  ///< besides landmarks and walls
  std::vector<Moving> moving;       ///< simulation only
  SceneEffects effects;             ///< simulation only

  friend bool operator==(const Map&, const Map&) = default;
};

/// @throws FileError with a line for each bad key: file, line, key, value, unit, and what would be right; likewise for
/// keys that are unknown (with the known ones), missing or given twice, and for a file that cannot be read
Map read_map(const std::filesystem::path& file);
/// The same from a node of a larger file (run.yaml). `file` is named in messages; relative paths start at its folder.
Map parse_map(const YAML::Node& node, const std::filesystem::path& file);
/// The file's YAML with its paths made absolute, to be put into another file (run.yaml) from which parse_map then reads
/// the same map. @throws FileError as read_map
YAML::Node load_map_node(const std::filesystem::path& file);

}  // namespace twocone::files
