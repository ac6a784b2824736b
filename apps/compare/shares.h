// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/compare/held_out.h"
#include "apps/compare/pictures.h"
#include "apps/compare/residuals.h"
#include "localisation/trajectory_error.h"

namespace twocone::compare {

/// The gaps of the real run, before and after, and what of each the sources that differ explain (Source::shares is
/// filled).
///
/// A share is a projection: with e the gap of each measurement and e_k what source k adds to it, sum(e_k e) / sum(e^2).
/// What is unexplained is the same of what is left, with all of the calibration's numbers put in; Gap::unnamed is what
/// these put right without a source that differs. All add to 1; a share is below 0 where a source hides a part of
/// another's effect. Noise is a part of e, so it stays unexplained.
///   range      held-out ranges; e the range under the believed rig less the distance to the reference
///   odometry   what the wheels tell of each metre, in place, against the reference; e_k by the wheels' sizes and the
///              pictures' age; no floor where the simulated places were rendered again: nothing was driven there
///   brightness log ratios of the pictures' colours; e_k is the gain that was found
///   noise      squares of grey levels; after: the doubt of what was found
std::vector<Gap> find_gaps(const Side& simulated, const Side& real, const std::vector<HeldOutRange>& held_out,
                           const Pictures& pictures, bool is_rendered, std::vector<Source>& sources);

/// What is believed, or was found, of the wheels: their sizes, and how much later they are read than pictures are
/// taken.
struct WheelsAs {
  double radius_m = 0, separation_m = 0;
  double latency_s = 0;
};

/// The odometry of a run's wheel angles by such wheels, when its pictures were taken; from the run's first odometry
/// pose on. Straight between two readings.
std::vector<runs::PoseRow> odometry_by(const runs::RunData& run, const WheelsAs& wheels);

/// Reference and odometry at the frames where there is a reference.
std::vector<localisation::PosePair> pairs_with(const std::vector<std::optional<runs::PoseRow>>& reference,
                                               const std::vector<runs::PoseRow>& odometry);

/// Wheels' errors are told over so much of the way.
constexpr double kOdometryStretch_m = 1.0;

}  // namespace twocone::compare
