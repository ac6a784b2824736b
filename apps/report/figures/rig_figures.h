// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/report/figures/figure.h"

namespace twocone::report {

/// Figure 8: the rig from the side, true to scale: what each mirror sees, and what both see.
Figure draw_geometry(const Drawing& drawing);

/// What a pixel of disparity is worth against the range, with the errors of this run. Nothing for other cones.
std::optional<Figure> draw_resolution(const Drawing& drawing);

}  // namespace twocone::report
