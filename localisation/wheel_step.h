// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "localisation/pose_filter.h"

/// One step of the wheels in the state that PoseHypothesis describes; the filters share it.
namespace twocone::localisation {

/// Indices into the state.
enum PoseStateIndex : int { kX, kY, kHeading, kLeftSlip, kRightSlip, kLeftReading, kRightReading, kBendState };

/// The state after a step, and what it depends on. The covariance after it is
/// by_state P by_state^T + by_readings by_readings^T angle_rad^2 + renewed, with 1 for the bend.
struct WheelStep {
  PoseHypothesis::Vector state = PoseHypothesis::Vector::Zero();
  PoseHypothesis::Matrix by_state = PoseHypothesis::Matrix::Zero();
  Eigen::Matrix<double, 8, 2> by_readings = Eigen::Matrix<double, 8, 2>::Zero();  ///< by the new readings' errors
  double renewed = 0;                                                             ///< variance that each slip gains
  /// Of (x, y, heading) by the relative errors of the left and right radius and the error of the separation, true minus
  /// believed: how far the true pose gets ahead of the estimate.
  Eigen::Matrix3d by_wheels = Eigen::Matrix3d::Zero();

  [[nodiscard]] PoseHypothesis::Matrix covariance(const PoseHypothesis::Matrix& before,
                                                  const OdometryNoise& noise) const;
};

/// Computes the step of the wheels by these angles in `dt_s` >= 0.
WheelStep wheel_step(const PoseHypothesis::Vector& state, const PoseHypothesis::Matrix& covariance, double dt_s,
                     double left_rad, double right_rad, const WheelGeometry& wheels, const OdometryNoise& noise);

/// Returns the covariance of slips, reading errors and bend at a start; the pose has none.
PoseHypothesis::Matrix start_covariance(const OdometryNoise& noise);

}  // namespace twocone::localisation
