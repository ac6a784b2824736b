// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <numbers>
#include <optional>
#include <string>

#include "apps/config/map_file.h"
#include "apps/design/sight.h"
#include "base/errors.h"

namespace twocone::design {

/// What a pair of mirrors is required to do, and what there is to build it from. Elevations are seen from a mirror's
/// eye (the point V of vision::MirrorView), counted from the horizon upwards.
struct Requirements {
  // ---- the cameras, two of a kind
  int width_px = 640, height_px = 480;
  double camera_angle_rad = 48 * std::numbers::pi / 180;  ///< field of view along the image's shorter side, in (0, pi)
  // ---- what both mirrors shall show
  double lowest_rad = -16 * std::numbers::pi / 180;
  double highest_rad = 2 * std::numbers::pi / 180;
  std::optional<double> floor_from_m{};  ///< both shall show the floor from this distance on
  // ---- accuracy
  double sigma_m = 0.03;  ///< greatest standard deviation of a range at `at_m`, at any height that both show there
  double at_m = 3;
  double sigma_px = 0.15;  ///< standard deviation of a disparity (Sight::range_sigma_m)
  // ---- sizes
  double greatest_radius_m = 0.06;  ///< of the mirrors
  double greatest_height_m = 0.90;  ///< of the robot, from the floor to the back of the upper mirror
  double lens_height_m = 0.25;      ///< of the lower lens over the floor: the body and the camera are below it
  double body_radius_m = 0.20;
};

/// The measures of a pair of equal mirrors and cameras.
struct Design {
  int width_px, height_px;
  double apex_rad, mirror_radius_m, lens_to_tip_m, mirror_separation_m, lens_height_m, rim_radius_px, body_radius_m;

  /// Returns the height of the cone, from its tip to its rim.
  [[nodiscard]] double cone_height_m() const;
};

/// No pair of cones does what is required. The message is one line: what cannot be, and the nearest that can.
struct CannotBe : base::FormattedError {
  using Formatted::Formatted;
};

/// The plate on which a mirror is fixed, and the room of a camera below its lens.
constexpr double kPlate_m = 0.010, kCamera_m = 0.060;
/// A lens that is nearer to a mirror's tip does not focus, and sees itself.
constexpr double kLeastLensToTip_m = 0.025;

/// Returns the pair of cones that does what is required with the largest mirrors, because tolerances count least there,
/// and then the least separation: a larger one makes ranges more accurate, but both mirrors then see less in common.
/// The whole image is used: what the cameras show beyond what is required is given to both ends.
///
/// With the image's focal length f, the rim at r_m px and the cone's angle A, a mirror shows the elevations from
/// pi/2 - A + atan(innermost / f) to pi/2 - A + atan(r_m / f); and d / R = f / r_m - cot(A / 2). Measures are rounded
/// to what can be made: millimetres and tenths of a degree.
/// @throws std::invalid_argument naming each requirement outside its domain; CannotBe
Design design(const Requirements& requirements);
/// Returns what a pair sees.
Sight sight_of(const Design& design);

/// The files of a design.
struct Files {
  std::filesystem::path robot, map, scene, profile, page, data;
};
/// Returns FOLDER/NAME.yaml, NAME.map.yaml, NAME.pov, NAME.dxf, index.html and design.json.
/// @throws base::InvalidArgument if the name has other characters than letters, digits, _ and -
Files files_in(const std::filesystem::path& folder, const std::string& name);

/// Writes the simulated robot, which runs as it is, its map and its scene, and the profile of the mirror for a lathe
/// (DXF, millimetres).
/// @param room the map of a room with a scene, whose robot is left out; nothing: a room of 6 x 5 m with six landmarks
/// that both mirrors show from near by to far away
/// @throws std::runtime_error: a file cannot be written, or the scene's robot cannot be left out
void write_robot(const Design& design, const std::optional<config::Map>& room, const Files& files);

/// Returns the drawing of a mirror's profile, one half of it, as DXF (R12, lines, millimetres): the axis is x = 0, the
/// tip the origin.
std::string profile_dxf(const Design& design);

}  // namespace twocone::design
