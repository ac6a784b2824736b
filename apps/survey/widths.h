// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "base/plane.h"
#include "vision/calibration.h"

/// What the widths of outlines say: whether something hides a part of a landmark, and its radius.
namespace twocone::survey {

/// Removes the sightings of landmarks that something hides in part, since their bearing is wrong by the part that is
/// hidden. That makes them narrower and never wider, so that the greatest width on which many sightings agree is that
/// of the whole landmark.
void remove_narrow(std::vector<vision::CalibrationFrame>& frames, std::size_t landmarks);

/// Measures the radii by the widths of the outlines, and states their sigma. Blur and the brightness beside an outline
/// widen all outlines of a view by some tenth of a pixel: that is an unknown, too, which near and far landmarks
/// separate from the radii.
void measure_radii(const std::vector<vision::CalibrationFrame>& frames, std::vector<Landmark>& landmarks);

}  // namespace twocone::survey
