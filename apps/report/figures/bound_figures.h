// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/report/figures/drawing.h"

namespace twocone::report {

/// Draws the position error against time, with the Cramer-Rao bound of each frame as a line: sqrt(var x + var y).
/// Returns nothing without truth or bounds.
std::optional<Figure> draw_error_and_bound(const Drawing& drawing);

/// Draws the distributions of the normalised errors (range error over its sigma; squared position error in units of its
/// covariance), beside those that correct sigmas give: standard normal, and chi-squared with two degrees of freedom.
/// Returns nothing for a method that states no sigmas.
std::optional<Figure> draw_normalised_errors(const Drawing& drawing);

}  // namespace twocone::report
