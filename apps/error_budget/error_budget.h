// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "localisation/odometry.h"

/// The error budget: the contribution of each wrong belief of a robot to its errors of range and position.
namespace twocone::error_budget {

/// Standard deviations of the sources of error, and the conditions under which they act. A source with 0 contributes 0.
/// The errors of the lower and the upper mirror are independent and have separate lines, unless a comment states that
/// they are equal in both.
struct ErrorBudgetSettings {
  double edge_noise_px = 0.1;                      ///< of the outline, per pixel of its length (vision::Sighting), > 0
  double rim_radius_px = 1;                        ///< r_m, equal in both mirrors
  double centre_px = 1;                            ///< of column and row of the tip
  double focal_share = 0.01;                       ///< of v, relative; caused by a wrong R, equal in both mirrors
  double lens_to_tip_m = 1e-3;                     ///< d, equal in both mirrors
  double separation_m = 1e-3;                      ///< s
  double tilt_rad = 0.1 * std::numbers::pi / 180;  ///< about x and about y
  double axis_offset_m = 1e-3;                     ///< in x and in y
  double apex_rad = 0.1 * std::numbers::pi / 180;
  double azimuth_rad = 0.1 * std::numbers::pi / 180;
  double skew_s = 5e-3;            ///< time from the lower exposure to the upper one; the pose is that of the lower one
  double landmark_place_m = 5e-3;  ///< x and y of each landmark in the map
  double landmark_top_m = 2e-3;    ///< of each landmark
  double landmark_radius_m = 1e-3;

  double speed_mps = 0;        ///< of the robot, forwards; skew turns it into an error
  double turn_rate_radps = 0;  ///< counter-clockwise
  double range_m = 2.5;        ///< distance at which ranges are evaluated, > 0
  bool tops_known = true;      ///< true: the map's top heights are used; false: disparity only, as in the paper
  int draws = 400;             ///< Monte Carlo draws for each line, >= 1
  std::uint64_t seed = 1;
};

/// Returns the defaults with the robot at full wheel speed on its tightest bend, where one wheel stands still.
ErrorBudgetSettings settings_for(const config::Robot& robot);

/// Root mean square of an error, metres.
struct Contribution {
  double analytic_m = 0;     ///< by linear propagation
  double monte_carlo_m = 0;  ///< by random draws; its relative error is 1 / sqrt(2 draws), 3.5 % for 400 draws
};

struct ErrorBudgetLine {
  std::string source;  ///< "centre, lower mirror"
  std::string size;    ///< "1 px", the standard deviation
  Contribution range;
  Contribution position;
};

struct ErrorBudget {
  std::vector<ErrorBudgetLine> lines;
  ErrorBudgetLine total;  ///< of all sources at once
  double range_m = 0;
  int ranges = 0;           ///< number of cases, landmark and bearing, in the mean of a range; 0: no top is visible
  int poses = 0;            ///< number of poses in the mean of a position; 0: none determines a position
  int draws = 0;            ///< number of draws for each line and column
  int withheld_ranges = 0;  ///< number of withheld answers over all draws
  int withheld_positions = 0;
};

/// Returns, for each source, the error of the answers of a robot that believes a wrong rig or map. The true rig's
/// images of the tops' near points (vision::near_top_point) are triangulated with the wrong rig (vision::triangulate)
/// and located in the wrong map (localisation::fix_by_least_squares). Ranges are to each kind of landmark of the map,
/// at the distance range_m and at bearings over the full circle. Positions are at `poses`.
///
/// The analytic column is sqrt(sum over a source's independent parts of (d answer / d part * sigma)^2). d range is
/// computed by central differences of the triangulation, d position by the gain of the weighted least squares. The
/// Monte Carlo column draws all parts of a source at once and computes the complete answers. If the columns differ by
/// more than the error of the draws, the source is too large for a linear model.
///
/// Sightings are weighted by the noise of their outlines only (vision::sighting_information), not by the other errors.
/// The stated covariances are scaled up, because a chi-squared gate would otherwise withhold answers with large errors.
/// @throws config::FileError for a rig that vision rejects; std::invalid_argument that names settings outside their
/// domain
ErrorBudget error_budget(const config::Robot& robot, const config::Map& map, std::span<const localisation::Pose> poses,
                         const ErrorBudgetSettings& settings);

/// Returns a grid of poses over the whole free area of the arena, for use without a run. The step is a sixth of the
/// longer side, and the headings are spread over the full circle.
std::vector<localisation::Pose> grid_poses(const config::Robot& robot, const config::Map& map);

}  // namespace twocone::error_budget
