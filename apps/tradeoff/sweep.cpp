// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace twocone::tradeoff {

std::vector<std::size_t> pareto_frontier(std::span<const CostAndError> points) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].cost) && std::isfinite(points[i].error)) order.push_back(i);
  }
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::tuple(points[i].cost, points[i].error, i); });
  double least = std::numeric_limits<double>::infinity();
  std::erase_if(order, [&](std::size_t i) {
    if (points[i].error >= least) return true;
    least = points[i].error;
    return false;
  });
  return order;
}

void mark_frontiers(std::vector<SettingResult>& settings) {
  constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();
  std::vector<CostAndError> robot, simulation;
  for (SettingResult& s : settings) {
    s.on_robot_frontier = s.on_simulation_frontier = false;
    const double error = answers_enough(s) ? s.position_m->mean.value : kNoFigure;
    // A robot cannot choose its light or the noise of its sensor.
    robot.push_back({s.robot_time_s().value, s.setting.images.effects == Effects::kScene ? error : kNoFigure});
    simulation.push_back({s.simulation_time_s().value, error});
  }
  for (const std::size_t i : pareto_frontier(robot)) settings[i].on_robot_frontier = true;
  for (const std::size_t i : pareto_frontier(simulation)) settings[i].on_simulation_frontier = true;
}

}  // namespace twocone::tradeoff
