// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/error_budget/error_budget.h"
#include "apps/error_budget/viewpoint.h"

namespace twocone::error_budget {

/// One independent number that may be wrong.
struct Part {
  int landmark = -1;  ///< the only landmark that it affects; -1: all
  /// Adds an error of `sigmas` standard deviations to `world`.
  std::function<void(World& world, double sigmas)> apply;
};

/// A line of the error budget: parts with independent errors.
struct Source {
  std::string name;
  std::string size;
  std::vector<Part> parts;
};

/// Returns all sources of the settings, for a world with `landmarks` landmarks.
std::vector<Source> all_sources(const ErrorBudgetSettings& settings, int landmarks);

}  // namespace twocone::error_budget
