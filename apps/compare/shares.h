// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/compare/held_out.h"
#include "apps/compare/images.h"
#include "apps/compare/residuals.h"
#include "localisation/trajectory_error.h"

namespace twocone::compare {

/// Returns the gaps of the real run before and after correction, and fills Source::shares: the part of each gap that
/// each source explains.
///
/// A share is a projection: with e the gap of each measurement and e_k the part that source k adds to it, sum(e_k e) /
/// sum(e^2). `unexplained` is the same projection of the remainder, after all of the calibration's numbers are
/// corrected. Gap::unnamed is the part that these numbers correct without a source that differs. All of these add to 1.
/// A share is below 0 where a source hides a part of another's effect. Noise is a part of e, so it stays unexplained.
/// range held-out ranges; e is the range under the believed rig minus the distance to the reference
/// odometry the wheels' motion over each metre, in the frame of its start, against the reference; e_k comes from the
/// sizes of the wheels and the age of the images; there is no floor where the simulated poses were rendered again,
/// because nothing was driven there
/// brightness log ratios of the images' colours; e_k is the gain that was found
/// noise squares of grey levels; `after` is the uncertainty of the gap that was found
std::vector<Gap> find_gaps(const Side& simulated, const Side& real, const std::vector<HeldOutRange>& held_out,
                           const Images& images, bool is_rendered, std::vector<Source>& sources);

/// Believed or measured numbers of the wheels: their sizes, and how much later they are read than images are taken.
struct WheelsAs {
  double radius_m = 0, separation_m = 0;
  double latency_s = 0;
};

/// Returns the odometry from a run's wheel angles with such wheels, at the times of its images, beginning at the run's
/// first odometry pose. It interpolates linearly between two readings.
std::vector<runlog::PoseRow> odometry_by(const runlog::RunData& run, const WheelsAs& wheels);

/// Returns pairs of reference and odometry at the frames that have a reference.
std::vector<localisation::PosePair> pairs_with(const std::vector<std::optional<runlog::PoseRow>>& reference,
                                               const std::vector<runlog::PoseRow>& odometry);

/// Wheel errors are measured over this length of the path.
constexpr double kOdometryStretch_m = 1.0;

}  // namespace twocone::compare
