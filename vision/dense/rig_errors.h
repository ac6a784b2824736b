// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/dense_ranging.h"
#include "vision/uncertain_rig.h"

namespace twocone::vision {

/// The standard deviation of a range by the errors of the rig, as a table of azimuth, slope and distance.
class RigErrorsOfRange {
 public:
  RigErrorsOfRange(const UncertainRig& rig, const PanoramaGrid& grid, double nearest_m);

  /// Returns 0 for an exact rig. @param along_m horizontal distance; the search's nearest one is the least
  [[nodiscard]] double sigma_m(int azimuth, int slope, double along_m) const;

 private:
  PanoramaGrid grid_;
  double nearest_m_;
  /// Of a range, over the square of the range: by azimuth, slope and inverse distance. Empty: the rig is exact.
  std::vector<float> sigmas_;
};

}  // namespace twocone::vision
