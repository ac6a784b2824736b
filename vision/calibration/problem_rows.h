// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/calibration.h"
#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// @throws std::invalid_argument as calibrate() says
void check(const CalibrationProblem& problem);

/// The problem as rows, and what they came from.
struct Bundle {
  BundleData data;
  BundleState start;
  std::vector<SightingResidual> origins;  ///< of data.sightings, in their order
  std::vector<std::size_t> frames;        ///< of start.poses: index into the problem's frames
};

/// Frames without a start pose are left out, their wheels then belong to the way of the next one.
Bundle bundle_of(const CalibrationProblem& problem);

}  // namespace twocone::vision::calibration
