// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/map_file.h"

namespace twocone::config {

/// Returns whether the closed outline through `corners` neither crosses nor touches itself: it has at least three
/// corners, no corner occurs twice, and no two edges share a point except the corner between neighbours. If three
/// points are in line to within rounding, the result may be either.
bool is_simple(const Polygon& corners);

}  // namespace twocone::config
