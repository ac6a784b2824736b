// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/files/map_file.h"
#include "localisation/fix.h"

namespace twocone::runs {

/// How many sigmas beyond the walls a position is no longer taken for one at the wall: a normal number is larger once
/// in a million. (The body's origin is its radius away from any wall, so map and rig may be wrong by that besides.)
constexpr double kOutsideSigmas = 4.75;

/// Judges a fix by the map's bounds, which are walls: a robot is never outside.
///
/// A position outside, by more than kOutsideSigmas of its own sigma along the way to the nearest wall, makes the fix
/// `out_of_bounds`; it keeps the position and its covariance. Of `ambiguous` a position outside is dropped where the
/// other one is not, which is then `ok`; where both are outside, the first is kept as `out_of_bounds`. `weak` is not
/// judged, since its position may lie anywhere along the unseen direction, nor is a fix without covariance.
void check_bounds(const files::Bounds& bounds, localisation::Fix& fix);

}  // namespace twocone::runs
