// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>

#include "twocone/types.h"

/// Position and heading from ranges and bearings of known landmarks. Link twocone::localisation; it needs no camera.
namespace twocone {
inline namespace v1_0 {

/// The measurement of one landmark at a known place. Angles are counter-clockwise from the body's x axis.
struct LandmarkObservation {
  double x_m = 0, y_m = 0;            ///< the landmark's axis, world frame
  std::optional<double> range_m;      ///< horizontal distance from the body's origin, >= 0
  std::optional<double> bearing_rad;  ///< in the body frame
  double sigma_range_m = 0;           ///< standard deviation, > 0 where there is a range
  double sigma_bearing_rad = 0;       ///< > 0 where there is a bearing
};

/// Returns the most likely pose for Gaussian measurements, with its covariance. A pose requires two landmarks with
/// range and bearing, one range and two bearings, or three bearings. Three ranges give no heading, so the pose is empty
/// then. Measurements that the others outvote are found and left out. Error growth and limits: docs/accuracy.md.
[[nodiscard]] PoseAnswer locate(std::span<const LandmarkObservation> observations);

}  // namespace v1_0
}  // namespace twocone
