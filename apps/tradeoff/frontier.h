// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// A point of the plane; smaller is better in both.
struct CostAndError {
  double cost = 0, error = 0;
};
/// Returns the indices of the points that no other point dominates (as good in both numbers and better in one), by
/// rising cost. Points that are not finite are on no frontier; of equal points the first one is.
std::vector<std::size_t> pareto_frontier(std::span<const CostAndError> points);

/// Sets SettingResult::on_robot_frontier and on_simulation_frontier. They use the mean position error against
/// robot_time_s() and simulation_time_s(), over the settings that answer often enough (kLeastAnswered); the robot's
/// frontier uses Effects::kScene only.
void mark_frontiers(std::vector<SettingResult>& settings);

}  // namespace twocone::tradeoff
