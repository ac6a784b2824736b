// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/report/figures/figure.h"

namespace twocone::report {

/// The paper's figures 11 to 16: for each landmark of the map true and computed range against the frame number, the
/// error below, and where there is no range a mark coloured by the reason. Landmarks of other names get one too.
std::vector<Figure> draw_ranges(const Drawing& drawing);

}  // namespace twocone::report
