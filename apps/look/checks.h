// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/look/look.h"
#include "drivers/sim_povray/effects.h"
#include "drivers/sim_povray/scene_geometry.h"
#include "hal/image.h"

/// The checks of look(). Each adds its findings, and says in `checked` what it compared.
namespace twocone::look {

/// What a check needs. All outlive it.
struct Subject {
  const config::Robot& robot;
  const config::Map& map;
  const sim_povray::KeyPlaces& places;  ///< of robot file and map

  /// Returns the file and line of `start:`, and of the map's nth obstacle or landmark.
  /// @param list "obstacles" or "landmarks"
  [[nodiscard]] std::string place_of_start() const;
  [[nodiscard]] std::string place_of(std::string_view list, std::size_t index) const;
  /// Returns the height of the upper mirror's rim over the floor, by the robot file's `rig:`.
  [[nodiscard]] double robot_height_m() const;
};

/// Differences of up to this are the rounding of a map that is written in millimetres (0.5 mm in x and in y are 0.7 mm
/// in the plane). A robot's best positions are off by half as much.
constexpr double kMap_m = 0.001;
/// A floor that is higher or lower: tape is thinner, and 2 mm of height are 10 mm of range.
constexpr double kFloor_m = 0.002;
/// The difference of hue from which a colour is another: a quarter of the window in which vision accepts a pixel as the
/// landmark's (HueLabels::kHueWindow_rad). Light and noise need the rest.
constexpr double kHue_deg = 5;
/// Lower things are left out of maps and of this check: tape, door sills, the plates under landmarks.
constexpr double kLow_m = 0.02;
/// Side of the squares into which the floor is divided (SceneGeometry::cells_of).
constexpr double kCell_m = 0.02;
/// Something this near to an obstacle of the map, or to a wall, belongs to it. An outline is accurate to 1 cm, which is
/// 1.4 cm at a corner, and the middle of a cell is up to 1.4 cm from what it holds; doors and skirting boards stand out
/// from their walls by the rest. Behaviours stay four times as far away (behaviours::Wander::kMargin_m).
constexpr double kCover_m = 0.05;

/// Compares each landmark with the surfaces at its place: horizontal rays from its axis find its side, to which a
/// circle is fitted, and those near its top find where the side ends.
void check_landmarks(const Subject& subject, const sim_povray::SceneGeometry& scene, Look& look);
/// Returns the height at which the plan cuts the scene: over the robot and all landmarks, but below the ceiling.
double plan_height_m(const Subject& subject, const sim_povray::SceneGeometry* scene);
/// Looks for things between kLow_m and the robot's height that nothing of the map covers, and for obstacles of the map
/// where nothing is, even up to the plan's height.
void check_obstacles(const Subject& subject, const sim_povray::SceneGeometry& scene, Look& look);
/// Checks that the body at the start touches nothing of the map.
void check_start(const Subject& subject, Look& look);
/// Checks the height of the floor under the start.
void check_floor(const Subject& subject, const sim_povray::SceneGeometry& scene, Look& look);
/// Compares mirrors and landmarks in the first images with `rig:` and map.
void check_images(const Subject& subject, const Image& lower, const Image& upper, Look& look);

/// Returns the drawing of the room from above, an SVG file. @param above of `view`; none: it could not be rendered
std::string draw_above(const Subject& subject, const Look& look, const sim_povray::OverheadView& view,
                       const std::optional<Image>& above);

}  // namespace twocone::look
