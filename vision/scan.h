// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "vision/beam.h"
#include "vision/dense_ranging.h"

namespace twocone::vision {

/// Returns unknown, free, occupied.
std::string_view to_string(BeamState state);

struct ScanSettings {
  int beams = 360;      ///< >= 1, see beam_bearing_rad()
  double low_m = 0.05;  ///< what ends below this is floor, that the robot drives over
  double high_m = 0.8;  ///< what begins above this is passed under
  double sigmas = 3;    ///< a height counts as outside the two only by so many of its sigmas
};

/// Returns per beam the nearest thing between two heights. A thing is at least eight pixels of the beam, whose ranges
/// agree: single wrong ranges are usual in a range image.
///
/// A free beam says only that no *ranged* thing is before its range. What has no texture, and what neither mirror
/// shows, is not in it: mirrors that do not see the floor say nothing of what is low.
/// @throws std::invalid_argument naming every setting outside its domain
std::vector<Beam> scan_of(const RangeImage& image, const ScanSettings& settings = {});

/// A point of a range image.
struct RangedPoint {
  Eigen::Vector3d point_m;  ///< body frame
  double sigma_m;           ///< standard deviation of its horizontal range
};
/// Returns the points of all ranges, azimuth by azimuth.
std::vector<RangedPoint> points_of(const RangeImage& image);

}  // namespace twocone::vision
