// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "base/errors.h"

/// Robots and rooms as they are built: like the plan, but not quite. Each is drawn at random from stated tolerances, as
/// it is (built) and as its builder wrote it down (believed).
namespace twocone::as_built {

/// The half-width of a uniform distribution, in units of its standard deviation.
constexpr double kHalfWidthInSigmas = std::numbers::sqrt3;

/// Half-widths of uniform draws about what is believed, one draw for each number and, where there are two, for each
/// view. The believed files state half-width / kHalfWidthInSigmas as the sigma. The defaults are what a careful builder
/// achieves with a ruler, printed parts and lenses off the shelf.
struct Tolerances {
  // ---- of the rig
  double centre_px = 20;  ///< column and row of the tip
  double rim = 0.05;      ///< of the rim's radius in the image
  double azimuth_rad = std::numbers::pi;
  double tilt_rad = 2 * std::numbers::pi / 180;    ///< about x and about y
  double apex_rad = 0.4 * std::numbers::pi / 180;  ///< of the cone's full angle
  double mirror_radius_m = 0.002;
  double lens_to_tip_m = 0.002;
  double mirror_separation_m = 0.005;
  double lens_height_m = 0.005;
  double axis_offset_m = 0.005;  ///< of each lens from the body's axis, in x and in y
  /// k1 and k2 of each lens, in units of its focal length: a mild lens, which moves the rim of the lab's mirrors by up
  /// to 1.5 px.
  double distortion = 0.05;
  // ---- of the wheels
  double wheel_radius = 0.05;      ///< of the radius
  double wheel_separation = 0.05;  ///< of the separation
  // ---- of the landmarks
  double landmark_place_m = 0.010;  ///< x and y
  double landmark_top_m = 0.005;
  double landmark_radius_m = 0.001;
  double skew_s = 0.020;  ///< by which the upper camera's stamps are later than the lower one's, or earlier

  // ---- of effects that nobody states: from 0 to these, for each view if not said otherwise
  double slip = 0.02;  ///< standard deviation of each wheel's relative slip
  double read_noise_electrons = 10;
  double vignetting = 0.3;
  double defocus_px = 1.5;
  double exposure_time_s = 0.015;  ///< common to both cameras, like the following
  double readout_s = 0.015;
  /// The shot noise: the full well is between these two. With the read noise, a pixel at half of full scale then has a
  /// sigma of 0.5 to 0.8 % of full scale, 0.8 to 1.4 of 255 levels: a USB camera in a well-lit room.
  std::array<double, 2> full_well_electrons{8000, 20000};
};

/// What no model of the robot has. The amounts are these; which view, which direction and which sign is drawn.
struct Unmodelled {
  double lens_off_axis_m = 0.0005;  ///< one view's lens, across the axis of its cone
  /// By this much one view's mirror is outside of its cone at half its height, across the surface; tip and rim stay. It
  /// is a quadric (scene_text.cpp), round at its tip.
  double bulge_m = 0.0001;
  double lean_rad = 0.5 * std::numbers::pi / 180;  ///< of half of the landmarks, about the middle of the top
  double oval = 0.02;   ///< greatest less least diameter of the other landmarks, of their mean
  double colour = 0.1;  ///< half-width of the lamps' red and blue against their green
  double flicker = 0.05;
  int jpeg_quality = 85;
};

/// What the rig (config::Rig) cannot express of one view.
struct ViewFlaws {
  std::array<double, 2> lens_off_axis_m{};  ///< the lens from the cone's axis, in the unit's frame, x and y
  double bulge_m = 0;
};

/// What a landmark of the map cannot express.
struct LandmarkFlaws {
  double lean_rad = 0;       ///< of the axis; its place is that of the top
  double direction_rad = 0;  ///< in the world: where the top leans to, or of the longest diameter
  double oval = 0;
};

/// A robot and its room. `believed` has no `rig.sigma` or `landmark.sigma` of 0 unless a tolerance is 0; `built` has
/// nothing but 0, because it is the truth as far as the model can express it. Both have the same effects.
struct AsBuilt {
  std::uint64_t seed = 0;
  config::Robot built, believed;
  config::Map built_map, believed_map;
  ViewFlaws lower, upper;
  std::vector<LandmarkFlaws> landmarks;  ///< in the map's order
};

/// Draws a robot as built. Its believed rig is that of the plan, with the tip in the middle of the image and an azimuth
/// of 0. If the plan's rim is so large that a draw could leave the image, a lens of less focal length is believed: the
/// whole mirror is seen in each draw.
///
/// Each number has a generator of its own, named after it, so that a tolerance that is 0 changes no other draw.
/// @param plan of a simulated robot. Its rig must have cones (config::Rig has nothing else)
/// @param unmodelled none: the model can express everything but the cameras' and wheels' effects
/// @throws std::invalid_argument naming each tolerance that is negative or not finite, or a share that is 1 or more
/// @throws config::FileError if no such rig exists (a tip beyond its rim)
AsBuilt draw(const config::Robot& plan, const config::Map& map, std::uint64_t seed, const Tolerances& tolerances = {},
             const std::optional<Unmodelled>& unmodelled = {});

/// The scene cannot be used. The message is one line for the user.
struct BadPlan : base::FormattedError {
  using Formatted::Formatted;
};

/// The files that write() writes into a folder.
struct Files {
  std::filesystem::path scene;                   ///< scene.pov
  std::filesystem::path built_map, built;        ///< built.map.yaml, built.yaml
  std::filesystem::path believed_map, believed;  ///< believed.map.yaml, believed.yaml
};
Files files_in(const std::filesystem::path& folder);

/// Writes scene, maps and robots. The scene is a copy of the plan's without robot and landmarks, and with those as
/// built; both robots see it through the same effects. The copy finds its own files where the plan's scene does, so the
/// bytes depend on where the plan is, but not on `folder`.
/// @throws BadPlan: the plan's map has no scene, or the scene's robot or landmarks cannot be left out
/// @throws std::runtime_error: a file cannot be read or written
Files write(const AsBuilt& drawn, const std::filesystem::path& folder);

/// Returns the text about the robot `drawn.built`, its two cameras and the landmarks, for the end of a scene, as
/// write() has it. It depends on no declaration and no #default of that scene.
std::string scene_text(const AsBuilt& drawn);

}  // namespace twocone::as_built
