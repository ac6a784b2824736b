// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/budget/budget.h"
#include "apps/report/figures/figure.h"

namespace twocone::report {

/// The error budget as bars on a logarithmic axis: linear propagation as bars, the Monte Carlo as marks on them.
/// Nothing where it has neither ranges nor positions.
std::optional<Figure> draw_budget(const Drawing& drawing, const budget::Budget& budget);

}  // namespace twocone::report
