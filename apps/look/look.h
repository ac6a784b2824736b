// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "drivers/sim_povray/place.h"
#include "hal/result.h"

/// Shows a simulated robot before its first run: what its cameras see, and where robot file, map and scene disagree.
namespace twocone::look {

enum class Disagreement {
  kLandmarkMissing,  ///< nothing round stands where the map has a landmark
  kLandmarkPlace,
  kLandmarkRadius,  ///< also if it is not round or not upright
  kLandmarkTop,
  kLandmarkColour,
  kNotOnMap,      ///< the scene has something that nothing of the map covers
  kNotInScene,    ///< the scene has nothing where the map has an obstacle
  kStartTouches,  ///< the start is too near to something of the map
  kStartPlace,    ///< the scene shows the robot elsewhere
  kFloor,         ///< the floor under the start is not at height 0
  kSighting,      ///< what the cameras see of a landmark does not fit its place on the map
};

struct Finding {
  Disagreement kind{};
  std::string text{};  ///< one line: where, what, and by how much
  FloorPoint place{};  ///< where it is drawn
  /// The landmark as the scene has it, if that differs in place or radius.
  std::optional<Disc> in_scene{};
};

struct Look {
  std::vector<Finding> findings{};
  /// Middles of the cells (kCell_m) that hold something and that nothing of the map covers.
  std::vector<FloorPoint> uncovered{};
  /// What a person should know and what is no disagreement: a check that was not possible, a rig that differs from the
  /// images.
  std::vector<std::string> notes{};
  bool has_surfaces = false;                   ///< the map was compared with the scene's surfaces
  std::vector<std::string> checked{};          ///< one line for each check that was made
  std::vector<std::filesystem::path> files{};  ///< that were written, in order
};

struct LookOptions {
  std::filesystem::path out{};                         ///< folder of the images, which is made
  std::optional<sim_povray::RendererKind> renderer{};  ///< none: that of the map
};

/// Returns the files that look() writes: an image for each camera, NAME.png, and above.svg.
std::vector<std::filesystem::path> files_of(const config::Robot& robot, const std::filesystem::path& out);

/// Renders what each camera sees at the start, draws the room from above with what the map has over it, and compares.
/// The robot touches nothing, and no frame is lost, whatever the robot file says. A robot that attaches to a served
/// world is shown in a world of its own.
/// Errors: kRefused: the robot is not simulated, or its map has no scene; those of drivers::open_robot and of
/// rendering.
/// @throws config::FileError as config::to_robot_settings; runlog::DiskError
Result<Look> look(const config::Robot& robot, const config::Map& map, const LookOptions& options);

}  // namespace twocone::look
