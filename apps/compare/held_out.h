// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/compare/residuals.h"
#include "apps/compare/side.h"
#include "hal/result.h"

namespace twocone::compare {

/// A range of a frame that the calibration did not use.
struct HeldOutRange {
  double before_m = 0;          ///< under the believed rig, minus the distance to the reference
  double after_m = 0;           ///< with the rig and the exposure times that were found; minus the same distance
  double sigma_m = 0;           ///< stated by the new range
  std::vector<double> parts_m;  ///< contribution of each source, in the order of the sources; see below
};

/// Returns ranges from up to `most` frames between those of the calibration, made from new sightings with Side::found.
/// `before_m` is also given for ranges that the run withheld because both views contradict each other under the
/// believed rig. The part of a source is the change of the new range when that source alone is set back to what the
/// robot believes: its numbers of the rig, a landmark's place, or the time of the upper view or of a row. It is 0 for a
/// source that does not differ or does not act on ranges. Where no independent reference exists, the reference is the
/// frame's own fix by the new sightings, at its time. Returns nothing where there is no calibration or no reference.
/// Errors: kBadData (images of another size).
Result<std::vector<HeldOutRange>> held_out_ranges(const Side& real, const std::vector<Source>& sources, int most,
                                                  const std::function<void(double)>& progress);

}  // namespace twocone::compare
