// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vision/calibration.h"
#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// The shared numbers to hold at their priors: first the one that the data determine worst relative to its prior, then
/// the next with that one held, until the data determine each of the others at least as well as its prior does.
/// @param information from shared_information(); landmarks behind the shared numbers are never held
std::vector<int> unobserved(const Eigen::MatrixXd& information, const SharedModel& model);

/// Covariance of the unknowns when those of `held` stay at their priors, whose errors have their own sigmas.
Eigen::MatrixXd consider_covariance(const Eigen::MatrixXd& information, const std::vector<int>& held);

/// Fills in parameters, derived numbers last, and covariance.
/// @param covariance of the unknowns; landmarks may follow the shared numbers
void take_parameters(const SharedModel& model, const Shared& unknowns, const Eigen::MatrixXd& covariance,
                     const std::vector<int>& held, CalibrationResult& result);

/// The landmarks with at least one used sighting, in the map's order.
std::vector<std::size_t> seen_landmarks(const BundleData& data);

/// Fills in landmark_shifts and landmark_covariance.
/// @param covariance of the unknowns; the landmarks follow the shared numbers
void take_landmark_shifts(const BundleData& data, const BundleState& state, const Eigen::MatrixXd& covariance,
                          const std::vector<std::size_t>& seen, CalibrationResult& result);

}  // namespace twocone::vision::calibration
