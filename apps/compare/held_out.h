// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/compare/residuals.h"
#include "apps/compare/side.h"
#include "hal/result.h"

namespace twocone::compare {

/// A range of a frame that the calibration has not looked at.
struct HeldOutRange {
  double before_m = 0;          ///< under the believed rig, less the distance to the reference
  double after_m = 0;           ///< with what was found: rig, and times of exposure that differ; less the same
  double sigma_m = 0;           ///< that the new range states
  std::vector<double> parts_m;  ///< what each source adds to it, in the order of the sources; see below
};

/// Ranges from up to `most` frames between those of the calibration, sighted anew with Side::found. `before_m` stands
/// also for ranges that the run withheld, because both views contradict each other under the believed rig. The part of
/// a source is what becomes of the new range when that source alone is put back to what the robot believes: its numbers
/// of the rig, a landmark's place, or the time of the upper view or of a row. 0 for a source that does not differ or
/// does not act on ranges. Where no reference stands apart, it is the frame's own fix by the sightings made anew, at
/// its time. Errors: kBadData (pictures of another size). Empty where there is no calibration or no reference.
Result<std::vector<HeldOutRange>> held_out_ranges(const Side& real, const std::vector<Source>& sources, int most,
                                                  const std::function<void(double)>& progress);

}  // namespace twocone::compare
