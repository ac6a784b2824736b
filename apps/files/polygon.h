// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/files/map_file.h"

namespace twocone::files {

/// Whether the closed outline through `corners` neither crosses nor touches itself: at least three corners, no corner
/// twice, no two edges with a point in common but the corner between neighbours. Where three points are in line to
/// rounding, either answer may come.
bool is_simple(const Polygon& corners);

}  // namespace twocone::files
