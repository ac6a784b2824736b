// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "vision/calibration.h"
#include "vision/calibration/bundle.h"

/// How a calibration's problem becomes the rows of a bundle.
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

/// Returns whether sightings, or pointers to them, are of more than one landmark.
/// @param landmark their member that identifies the landmark
template <typename Sightings, typename Landmark>
bool show_two_landmarks(const Sightings& sightings, Landmark landmark) {
  return std::ranges::adjacent_find(sightings, std::ranges::not_equal_to{}, landmark) != sightings.end();
}

/// Variance of the mean of a Gauss-Markov process of variance 1 over `x` time constants: that of a wheel's slip over an
/// interval.
double mean_slip_variance(double x);

}  // namespace twocone::vision::calibration
