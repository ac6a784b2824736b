// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/place.h"

namespace YAML {
class Node;
}

namespace twocone::config {

using twocone::Bounds;
using twocone::Landmark;
using Point = FloorPoint;
using Polygon = std::vector<Point>;  ///< at least three corners; the outline must not cross itself
using Obstacle = std::variant<Polygon, Disc>;

/// Returns whether the closed outline through `corners` does not cross or touch itself: it has at least three
/// corners, no corner occurs twice, and no two edges share a point except the corner between neighbours. If three
/// points are in line to within rounding, the result may be either.
bool is_simple(const Polygon& corners);

/// An object that moves along a path at constant speed, the scene object `moving.NAME`. The name is unique and has
/// letters, digits and _. The path is inside the bounds.
using Moving = sim_povray::MovingThing;

/// Effects of the scene that the map may switch off (`effects:`), although the scene uses them.
using SceneEffects = sim_povray::SceneSwitches;

/// What a tape measure gives for a landmark, used where the map states no `sigma_m`: its place across a room to 5 mm,
/// the height of its top to 3 mm, its radius (from the circumference) to 1 mm.
constexpr LandmarkSigma kTapeSigma{.x_m = 0.005, .y_m = 0.005, .top_m = 0.003, .radius_m = 0.001};

/// The knowledge of a place that a robot may have (scenes/lab.map.yaml). A map contains no ground truth.
struct Map {
  std::filesystem::path file;                  ///< the path as the caller gave it
  std::optional<std::filesystem::path> scene;  ///< resolved against the file's folder; none for a real room
  /// Folders that the scene may read, as absolute paths: the folder of the map file, then those of `scene_paths:`. If
  /// it is empty, the scene's own folder is used. Simulation only.
  std::vector<std::filesystem::path> scene_paths{};
  double unit_m = 0.05;  ///< length of one POV-Ray unit, > 0; required if there is a scene
  Bounds bounds;         ///< the walls
  std::vector<Landmark> landmarks;
  /// Names of the landmarks for which the map states no `sigma_m`, and which therefore have kTapeSigma.
  std::vector<std::string> without_sigma{};
  /// File with the joint covariance of the landmarks and of the rig that surveyed them (calibration_file.h), in place
  /// of the landmarks' sigmas; resolved; empty: they are independent.
  std::filesystem::path survey{};
  std::vector<Obstacle> obstacles;  ///< other than landmarks and walls
  std::vector<Moving> moving;       ///< simulation only
  SceneEffects effects;             ///< simulation only
  /// `effects: {renderer: ...}`, simulation only
  sim_povray::RendererKind renderer = sim_povray::RendererKind::kAuto;

  friend bool operator==(const Map&, const Map&) = default;
};

/// @throws FileError with one line for each bad key: file, line, key, value, unit and the rule that applies. This
/// covers unknown keys (the line lists the known ones), missing keys, keys that are given twice, and a file that cannot
/// be read
Map read_map(const std::filesystem::path& file);
/// Reads a map from a node of a larger file (run.yaml). Messages name `file`, and relative paths start at its folder.
Map parse_map(const YAML::Node& node, const std::filesystem::path& file);
/// Returns the YAML of the file with absolute paths, for use inside another file (run.yaml). parse_map reads the same
/// map from it. @throws FileError as read_map
YAML::Node load_map_node(const std::filesystem::path& file);

/// Returns the text of a map file that equals `original`, except for the scene, the survey and the landmarks, with
/// their sigmas, which are those of `changed`. Paths are absolute, except for a relative `changed.scene`, which is
/// written as it is: relative to the folder of the new file. Comments are lost, and the text states that.
/// @param new_file path for which the text is made; this function writes no file
/// @param header_lines comments at the start, after the licence line
/// @throws FileError as read_map, for `original`, and for values that read_map would reject in the new file
std::string map_text(const std::filesystem::path& original, const std::filesystem::path& new_file, const Map& changed,
                     const std::vector<std::string>& header_lines);

}  // namespace twocone::config
