// SPDX-License-Identifier: Apache-2.0
// This file is used in a build without Ceres. calibrate() returns kNoSolver before it would call these functions.
#include <cassert>

#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

bool has_solver() { return false; }

bool minimise(const BundleData& /*data*/, const BundleSettings& /*settings*/, BundleState& /*state*/) {
  assert(false);
  return false;
}

Eigen::MatrixXd shared_information(const BundleData& /*data*/, const BundleSettings& /*settings*/,
                                   const BundleState& /*state*/) {
  assert(false);
  return Eigen::MatrixXd::Identity(kSharedNumbers, kSharedNumbers);
}

}  // namespace twocone::vision::calibration
