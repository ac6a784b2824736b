// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/runs/run_data.h"
#include "localisation/odometry.h"
#include "vision/ranging.h"

namespace twocone::runs {

/// The best that a frame's pictures allow: standard deviations that no unbiased estimator undercuts (Cramer and Rao).
struct FrameBound {
  struct Landmark {
    double range_m = 0;  ///< of the range from this landmark's outlines alone, > 0
    double bearing_rad = 0;
  };
  std::uint64_t frame = 0;
  std::vector<std::optional<Landmark>> landmarks;  ///< in the map's order
  std::optional<Eigen::Matrix3d> covariance;       ///< of x (m), y (m), heading (rad) from all landmarks together
};

/// Standard deviation (px, for each pixel of length) of a landmark's outline in view "lower" or "upper"; nothing where
/// it is not seen.
using EdgeNoiseOf = std::function<std::optional<double>(const std::string& landmark, const std::string& view)>;

/// Information of range (m) and bearing (rad) that the outlines of each target, at its place in the world, carry for a
/// robot at `pose`: the sum over the views in which it is seen (vision::sighting_information).
std::vector<Eigen::Matrix2d> landmark_information(const vision::Rig& rig, const std::vector<vision::Target>& targets,
                                                  const std::vector<Eigen::Vector2d>& places_m,
                                                  const localisation::Pose& pose, const EdgeNoiseOf& edge_noise_px);

/// A bound for each frame of the run, from the rig and the map as believed, the true pose (on hardware the estimate)
/// and the noise of the outlines as the method measured it (sightings.csv): the frame's own, else the median over the
/// run of that landmark in that view.
///
/// Everything counts that the geometry shows, also what an obstacle hides: so the bound is never too large, and a ratio
/// to it never too good. A view in which a landmark was never sighted counts nothing. Without sightings: nothing at
/// all. Nothing for a frame without a pose, for a landmark whose outlines do not tell its range, for a pose that is not
/// determined.
/// @throws files::FileError for a rig that vision refuses
std::vector<FrameBound> bounds(const RunData& run);

}  // namespace twocone::runs
