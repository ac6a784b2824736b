// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// The landmarks with at least one used sighting, in the map's order.
std::vector<std::size_t> seen_landmarks(const BundleData& data);

/// Fills in landmark_shifts and landmark_covariance.
/// @param covariance of the unknowns; the landmarks follow the shared numbers
void take_landmark_shifts(const BundleData& data, const BundleState& state, const Eigen::MatrixXd& covariance,
                          const std::vector<std::size_t>& seen, CalibrationResult& result);

}  // namespace twocone::vision::calibration
