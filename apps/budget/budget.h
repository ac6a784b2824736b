// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "localisation/odometry.h"

/// The error budget: what each thing that a robot may believe wrongly adds to its ranges and positions.
namespace twocone::budget {

/// How wrong each thing is: standard deviations. 0 leaves a source's line at 0. Lower and upper mirror are wrong
/// independently, each with a line of its own, but for what is said to be alike in both.
struct BudgetSettings {
  double edge_noise_px = 0.1;   ///< of the outline, for each pixel of its length (vision::Sighting), > 0
  double rim_radius_px = 1;     ///< r_m, alike in both mirrors
  double centre_px = 1;         ///< the tip's column, and its row
  double focal_share = 0.01;    ///< v, of itself, alike in both (by a wrong R)
  double lens_to_tip_m = 1e-3;  ///< d, alike in both
  double separation_m = 1e-3;   ///< s
  double tilt_rad = 0.1 * std::numbers::pi / 180;  ///< about x, and about y
  double axis_offset_m = 1e-3;                     ///< in x, and in y
  double apex_rad = 0.1 * std::numbers::pi / 180;
  double azimuth_rad = 0.1 * std::numbers::pi / 180;
  double skew_s = 5e-3;            ///< the upper exposure after the lower one, which is the time of the pose
  double landmark_place_m = 5e-3;  ///< x, and y, of each landmark in the map
  double landmark_top_m = 2e-3;    ///< of each
  double landmark_radius_m = 1e-3;

  double speed_mps = 0;        ///< of the robot, forwards: what skew makes an error of
  double turn_rate_radps = 0;  ///< counter-clockwise
  double range_m = 2.5;        ///< at which the ranges are judged, > 0
  bool tops_known = true;      ///< the map's top heights are used; false: disparity only, as in the paper
  int draws = 400;             ///< of the Monte Carlo, for each line, >= 1
  std::uint64_t seed = 1;
};

/// The defaults at the robot's full speed, on the tightest bend that it can take at it: one wheel stands.
BudgetSettings settings_for(const files::Robot& robot);

/// Root mean square of an error, metres.
struct Contribution {
  double analytic_m = 0;     ///< by linear propagation
  double monte_carlo_m = 0;  ///< of draws; its own error is 1 / sqrt(2 draws): 3.5 % of itself for 400
};

struct BudgetLine {
  std::string source;  ///< "centre, lower mirror"
  std::string size;    ///< "1 px", as a standard deviation
  Contribution range;
  Contribution position;
};

struct Budget {
  std::vector<BudgetLine> lines;
  BudgetLine total;  ///< of all at once
  double range_m = 0;
  int ranges = 0;           ///< landmark and bearing, over which a range is averaged; 0: no top is seen at range_m
  int poses = 0;            ///< over which a position is averaged; 0: none determines a position
  int draws = 0;            ///< for each line and column
  int withheld_ranges = 0;  ///< answers that were asked for and withheld, over all draws
  int withheld_positions = 0;
};

/// For each source what a robot answers that believes a wrong rig or map, less the truth: the true rig's pictures of
/// the tops' near points (vision::near_top_point), triangulated by the wrong one (vision::triangulate), fixed in the
/// wrong map (localisation::fix_by_least_squares). Ranges to each kind of landmark of the map at range_m, at bearings
/// all round; positions at `poses`.
///
/// The analytic column is sqrt(sum over a source's independent parts of (d answer / d part * sigma)^2), d range by
/// central differences of the triangulation, d position by the weighted least squares' own gain. The Monte Carlo column
/// draws all parts of a source at once and runs everything: where the two disagree by more than the draws' own error,
/// the source is too large for a linear view of it.
///
/// Sightings are weighed as the noise of their outlines says (vision::sighting_information), however wrong the rest is;
/// the stated covariances are scaled up so that no gate on chi-squared withholds what is to be measured here.
/// @throws files::FileError for a rig that vision refuses; std::invalid_argument naming settings outside their domain
Budget error_budget(const files::Robot& robot, const files::Map& map, std::span<const localisation::Pose> poses,
                    const BudgetSettings& settings);

/// Poses all over the arena where the robot has room, a step of a sixth of its longer side apart, headings all round:
/// where no run says where it drives.
std::vector<localisation::Pose> grid_poses(const files::Robot& robot, const files::Map& map);

}  // namespace twocone::budget
