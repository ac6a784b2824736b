// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "base/errors.h"
#include "base/plane.h"
#include "drivers/sim_povray/scene_geometry.h"

/// From somebody's scene to a robot in it: wrapper, map and robot file.
namespace twocone::new_scene {

/// The scene has no place for a robot, or the program cannot decide. The message is one line for the user.
struct NoPlace : base::FormattedError {
  using Formatted::Formatted;
};

/// The robot that is put into a scene: that of the lab (scenes/parts/robot.inc). Heights above the floor, in metres.
struct StandardRobot {
  static constexpr double kRadius_m = 0.20;
  static constexpr double kHeight_m = 0.80;
  static constexpr double kLowerTip_m = 0.37;  ///< of the lower mirror, which sees nothing below this height
  static constexpr double kUpperTip_m = 0.67;
};

struct FoundLandmark {
  Landmark landmark;
  std::string place{};  ///< FILE:LINE in the scene; empty: it is added
  int object = -1;      ///< in the scene; -1: it is added
};

struct FoundObstacle {
  config::Polygon corners;
  std::string what;  ///< "box, FILE:LINE"
};

/// Where the floor is and how large the scene is meant.
struct Floor {
  double units = 0;   ///< its y in POV-Ray units
  std::string place;  ///< "plane, FILE:LINE"
  double unit_m = 0;
  std::string why_unit;
  FloorPoint centre;  ///< of the part that the scene's camera shows
};

/// What a scene offers a robot. World frame, metres: the floor is at z = 0.
struct Room {
  std::filesystem::path scene;  ///< absolute
  Floor floor;
  double open_m2 = 0;  ///< where the robot's axis can be, connected with the start
  Bounds bounds;
  std::vector<FoundLandmark> landmarks;
  std::vector<FoundObstacle> obstacles;
  Pose2 start;
  sim_povray::Leniency leniency;
  std::vector<std::string> warnings;
};

struct RoomSettings {
  std::filesystem::path scene;
  std::vector<std::filesystem::path> scene_paths{};  ///< folders that the scene may read, besides its own
  std::optional<double> unit_m{};                    ///< length of one POV-Ray unit; none: it is estimated
};

/// Finds floor, obstacles, landmarks and a start in a scene. Adds landmarks if the scene has fewer than three.
/// @throws NoPlace
Room find_room(const RoomSettings& settings);

/// The files that write_files() writes.
struct NewFiles {
  std::filesystem::path wrapper, map, robot;
};
/// Returns the names of the files for a scene: FOLDER/NAME.pov, FOLDER/NAME.map.yaml and FOLDER/NAME.yaml.
NewFiles files_for(const std::filesystem::path& scene, const std::filesystem::path& folder);
/// Writes the three files. The robot file runs as it is. @throws std::runtime_error: a file cannot be written
void write_files(const Room& room, const RoomSettings& settings, const NewFiles& files);

}  // namespace twocone::new_scene
