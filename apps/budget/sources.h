// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/budget/budget.h"
#include "apps/budget/station.h"

namespace twocone::budget {

/// One independent number that may be wrong.
struct Part {
  int pillar = -1;  ///< the only one whose answer depends on it; -1: all
  /// Makes `world` wrong by `sigmas` standard deviations.
  std::function<void(World& world, double sigmas)> apply;
};

/// A line of the budget: parts that are wrong independently.
struct Source {
  std::string name;
  std::string size;
  std::vector<Part> parts;
};

/// All sources of the settings, for a world of so many pillars.
std::vector<Source> all_sources(const BudgetSettings& settings, int pillars);

}  // namespace twocone::budget
