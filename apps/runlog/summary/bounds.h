// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/config/to_layers.h"
#include "apps/runlog/run_data.h"
#include "localisation/odometry.h"
#include "vision/ranging.h"
#include "vision/uncertain_rig.h"

namespace twocone::runlog {

/// The lower bound of Cramer and Rao for a frame: the smallest standard deviations that an unbiased estimator can reach
/// with its images.
struct FrameBound {
  struct Landmark {
    double range_m = 0;  ///< of the range from this landmark's outlines alone, > 0
    double bearing_rad = 0;
  };
  std::uint64_t frame = 0;
  std::vector<std::optional<Landmark>> landmarks;  ///< in the map's order
  std::optional<Eigen::Matrix3d> covariance;       ///< of x (m), y (m), heading (rad) from all landmarks together
  /// The same, where map and rig are as uncertain as their files state; empty where both are exact.
  std::optional<Eigen::Matrix3d> whole_covariance;
};

/// Returns the standard deviation (px, per pixel of length) of a landmark's outline in view "lower" or "upper", or
/// nothing if the view does not show it.
using EdgeNoiseOf = std::function<std::optional<double>(const std::string& landmark, const std::string& view)>;

/// Returns the information on range (m) and bearing (rad) in the outlines of each target for a robot at `pose`, in the
/// lower and in the upper view (vision::sighting_information). It is zero where the view does not show the target.
std::vector<std::array<Eigen::Matrix2d, 2>> landmark_information(const vision::Rig& rig,
                                                                 const std::vector<Landmark>& targets,
                                                                 const std::vector<Eigen::Vector2d>& places_m,
                                                                 const localisation::Pose& pose,
                                                                 const EdgeNoiseOf& edge_noise_px);

/// Returns the bound of a pose where rig and landmarks are uncertain (localisation::shared_pose_bound).
/// @param targets,information as of landmark_information(), with its answer
std::optional<Eigen::Matrix3d> whole_bound(const vision::UncertainRig& rig, const config::BeliefErrors& errors,
                                           const std::vector<Landmark>& targets, const localisation::Pose& pose,
                                           const std::vector<std::array<Eigen::Matrix2d, 2>>& information);

/// Returns a bound for each frame of the run. It uses the rig and the map as believed, the true pose (on hardware the
/// estimate) and the noise of the outlines that the method measured (sightings.csv): that of the frame, or else the
/// median of that landmark in that view over the run.
///
/// The bound counts everything that the geometry shows, even if an obstacle hides it. So the bound is never too large,
/// and a ratio to it is never too good. A view in which a landmark was never sighted does not count. The result is
/// empty without sightings. A frame without a pose, a landmark whose outlines do not determine its range, and a pose
/// that is not determined have no bound.
/// @throws config::FileError for a rig that vision rejects
std::vector<FrameBound> bounds(const RunData& run);

}  // namespace twocone::runlog
