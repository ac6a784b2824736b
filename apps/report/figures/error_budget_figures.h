// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "apps/error_budget/error_budget.h"
#include "apps/report/figures/drawing.h"

namespace twocone::report {

/// Draws the error budget on a logarithmic axis: linear propagation as bars, the Monte Carlo as marks on them. Returns
/// nothing if the error budget has neither ranges nor positions.
std::optional<Figure> draw_error_budget(const Drawing& drawing, const error_budget::ErrorBudget& error_budget);

}  // namespace twocone::report
