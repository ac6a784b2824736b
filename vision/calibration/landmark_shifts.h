// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// Those of which a sighting is used, in the map's order.
std::vector<std::size_t> seen_landmarks(const BundleData& data);

/// Fills in landmark_shifts and landmark_covariance. @param covariance of the unknowns, landmarks behind the shared
/// ones
void take_landmark_shifts(const BundleData& data, const BundleState& state, const Eigen::MatrixXd& covariance,
                          const std::vector<std::size_t>& seen, CalibrationResult& result);

}  // namespace twocone::vision::calibration
