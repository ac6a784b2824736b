// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/robot_file.h"
#include "apps/runlog/run_data.h"
#include "apps/survey/rough_map.h"
#include "hal/result.h"

/// The start of a survey with a rig that is known by a ruler.
namespace twocone::survey {

/// Finds landmarks by their bearings in the lower view alone, from poses by the wheels alone.
///
/// With mirrors that are tilted by a degree, the two views do not agree on a range, and the direction in which the
/// camera is turned may not be known at all. Bearings about the tip, which find_mirror() finds, are still good to some
/// degrees. So landmarks are placed where their bearings meet best, for each direction of the camera, as it is and
/// mirrored, and the best direction is taken. Tops follow from the radii in the image. Places are good to some
/// decimetres, which is enough for the start of a calibration (calibrate::find_start).
///
/// Hues of which several things are seen at once are left out.
/// @param chosen of this run alone
/// @param robot sizes and heights of its rig are used, and its circles where no mirror is found
/// Error: kBadData for images that cannot be read, where fewer than three such landmarks are found, and where no
/// direction of the camera explains their bearings.
Result<RoughMap> find_bearing_map(const runlog::RunData& run, const calibrate::ChosenFrames& chosen,
                                  const config::Robot& robot);

}  // namespace twocone::survey
