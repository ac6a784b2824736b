// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/report/figures/drawing.h"

namespace twocone::report {

/// Draws figure 8: the rig from the side, to scale, with the region that each mirror sees and the one that both see.
Figure draw_geometry(const Drawing& drawing);

/// Draws the range of one pixel of disparity against the range, with the errors of this run. Returns nothing for other
/// cones.
std::optional<Figure> draw_resolution(const Drawing& drawing);

}  // namespace twocone::report
