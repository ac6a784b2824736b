// SPDX-License-Identifier: Apache-2.0
#include "twocone/localisation.h"

#include <vector>

#include "apps/interface/convert.h"
#include "localisation/least_squares_fix.h"

namespace twocone {
inline namespace v1_0 {

PoseAnswer locate(std::span<const LandmarkObservation> observations) {
  std::vector<localisation::LandmarkMeasurement> measurements;
  measurements.reserve(observations.size());
  for (const LandmarkObservation& o : observations) {
    localisation::LandmarkMeasurement& m = measurements.emplace_back();
    m.landmark_m = {o.x_m, o.y_m};
    m.range_m = o.range_m;
    m.bearing_rad = o.bearing_rad;
    m.covariance = Eigen::Vector2d(o.sigma_range_m * o.sigma_range_m, o.sigma_bearing_rad * o.sigma_bearing_rad)
                       .asDiagonal()
                       .toDenseMatrix();
  }
  return interface::to_answer(localisation::fix_by_least_squares(measurements));
}

}  // namespace v1_0
}  // namespace twocone
