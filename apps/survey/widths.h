// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/plane.h"
#include "vision/calibration.h"

/// What the widths of outlines say: whether something hides a part of a landmark, and its radius.
namespace twocone::survey {

/// Removes the sightings of landmarks that something hides in part in one of the views (vision/unhidden_width.h).
/// @param landmarks with the radii of the expected widths
void remove_narrow(std::vector<vision::CalibrationFrame>& frames, const std::vector<Landmark>& landmarks);

/// Measures the radii by the widths of the outlines, and states their sigma. Blur and the brightness beside an outline
/// widen all outlines of a view by some tenth of a pixel: that is an unknown, too, which near and far landmarks
/// separate from the radii. A radius also follows those of the other landmarks, as far as these are alike: the images
/// of a far landmark alone hardly tell its radius from its range (vision/alike_radii.h).
void measure_radii(const std::vector<vision::CalibrationFrame>& frames, std::vector<Landmark>& landmarks);

}  // namespace twocone::survey
