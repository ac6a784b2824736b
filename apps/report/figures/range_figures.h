// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/report/figures/drawing.h"

namespace twocone::report {

/// Draws figures 11 to 16 of the paper: for each landmark of the map the true and the computed range against the frame
/// number, the error below, and for each frame without a range a mark coloured by the reason. Landmarks with names that
/// the paper does not have get a figure too.
std::vector<Figure> draw_ranges(const Drawing& drawing);

}  // namespace twocone::report
