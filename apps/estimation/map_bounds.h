// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/map_file.h"
#include "localisation/fix.h"

namespace twocone::estimation {

/// Number of sigmas beyond a wall above which a position counts as outside. A normal variable exceeds it once in a
/// million cases. (The body's origin is at least its radius away from any wall. This margin also allows for an error of
/// map and rig.)
constexpr double kOutsideSigmas = 4.75;

/// Checks a fix against the map's bounds. They are walls, so a robot is never outside.
///
/// A position that is outside by more than kOutsideSigmas of its sigma, along the direction to the nearest wall, makes
/// the fix `out_of_bounds`. It keeps the position and its covariance. If only one position of an `ambiguous` fix is
/// outside, that position is dropped and the fix is `ok`. If both are outside, the first is kept as `out_of_bounds`. A
/// `weak` fix is not checked, because its position may lie anywhere along the unseen direction. A fix without
/// covariance is not checked either.
void check_bounds(const config::Bounds& bounds, localisation::Fix& fix);

}  // namespace twocone::estimation
