// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/report/figures/figure.h"

namespace twocone::report {

/// The position's error against the time, with the Cramer-Rao bound of each frame as a line: sqrt(var x + var y).
/// Nothing without truth or bounds.
std::optional<Figure> draw_error_and_bound(const Drawing& drawing);

/// Whether the stated sigmas are true: how the normalised errors are distributed (range error over its sigma; position
/// error squared in units of its covariance), with the distributions that true sigmas give: standard normal, and
/// chi-squared with two degrees of freedom. Nothing where none are stated.
std::optional<Figure> draw_normalised_errors(const Drawing& drawing);

}  // namespace twocone::report
