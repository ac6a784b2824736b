// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/calibration.h"
#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// @throws std::invalid_argument as calibrate() states
void check(const CalibrationProblem& problem);

/// The problem as rows, with their origins in the problem.
struct Bundle {
  BundleData data;
  BundleState start;
  std::vector<SightingResidual> origins;  ///< of data.sightings, in their order
  std::vector<std::size_t> frames;        ///< of start.poses: index into the problem's frames
};

/// Makes the rows. Frames without a start pose are left out; their wheel readings then belong to the next frame's
/// motion.
Bundle bundle_of(const CalibrationProblem& problem);

}  // namespace twocone::vision::calibration
