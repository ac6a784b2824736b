// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/plane.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

constexpr double kListPitch_px = 17;

bool is_drawable(double value) { return std::isfinite(value) && value > 0; }

/// The smallest axis that shows all of `values`, with some air.
void fit(LogAxis& axis, std::vector<double> values) {
  std::erase_if(values, [](double value) { return !is_drawable(value); });
  const auto [least, most] = std::minmax_element(values.begin(), values.end());  // the paper's point is always there
  const double decades = std::max(std::log10(*most / *least), 0.5);
  constexpr double kAir = 0.06;
  axis.low = *least * std::pow(10, -kAir * decades);
  axis.high = *most * std::pow(10, kAir * decades);
}

std::vector<PlanePoint> least_bounds(const Sweep& sweep, const Plane& plane) {
  std::vector<CostAndError> all;
  for (const SettingResult& result : sweep.settings) {
    const Level level = result.setting.level;
    const double cost = cost_s(result, plane.cost).value / plane.unit_s;
    if ((level != Level::kFine && level != Level::kAdaptive) || !result.bound_m) continue;
    if (is_drawable(*result.bound_m) && is_drawable(cost)) all.push_back({cost, *result.bound_m / kMm});
  }
  std::vector<PlanePoint> least;
  for (const std::size_t i : pareto_frontier(all)) least.push_back({all[i].cost, all[i].error});
  return least;
}

std::vector<Mark> marks_of(const Sweep& sweep, const Plane& plane) {
  std::vector<Mark> marks;
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    const SettingResult& result = sweep.settings[i];
    if (!result.position_m) continue;
    const auto scaled = [](const Interval& v, double unit) {
      return Interval{v.value / unit, v.low / unit, v.high / unit};
    };
    Mark mark{i, {}, scaled(cost_s(result, plane.cost), plane.unit_s), scaled(result.position_m->mean, kMm)};
    mark.at = {mark.x.value, mark.y.value};
    mark.on_frontier = plane.cost == Cost::kRobotTime ? result.on_robot_frontier : result.on_simulation_frontier;
    mark.answers_enough = answers_enough(result);
    if (is_drawable(mark.at.x) && is_drawable(mark.at.y)) marks.push_back(mark);
  }
  std::stable_sort(marks.begin(), marks.end(), [](const Mark& a, const Mark& b) {
    return a.on_frontier != b.on_frontier ? b.on_frontier : a.at.x < b.at.x;
  });
  return marks;
}

}  // namespace

Interval cost_s(const SettingResult& result, Cost cost) {
  return cost == Cost::kRobotTime ? result.robot_time_s() : result.simulation_time_s();
}

double LogAxis::px(double value) const {
  return low_px + (high_px - low_px) * std::log(value / low) / std::log(high / low);
}

std::vector<std::pair<double, std::string>> LogAxis::tics() const {
  constexpr double kManyDecades = 4.5;
  const bool many = std::log10(high / low) > kManyDecades;
  std::vector<std::pair<double, std::string>> tics;
  for (int decade = int(std::floor(std::log10(low))); decade <= int(std::ceil(std::log10(high))); ++decade) {
    for (const int digit : {1, 2, 5}) {
      const double value = digit * std::pow(10, decade);
      if (value < low || value > high || (many && digit != 1)) continue;
      tics.emplace_back(value, fmt::format("{:g}", value));
    }
  }
  return tics;
}

Plane plane_of(const Sweep& sweep, Cost cost) {
  Plane plane;
  plane.cost = cost;
  plane.unit_s = cost == Cost::kRobotTime ? kMs : 1;
  plane.marks = marks_of(sweep, plane);
  for (const Mark& mark : plane.marks) {
    if (mark.on_frontier) plane.frontier.push_back(mark.at);
  }
  plane.bound = least_bounds(sweep, plane);
  plane.paper = {PaperPoint{}.time_s / plane.unit_s, PaperPoint{}.mean_error_m / kMm};

  std::vector<double> xs{plane.paper.x}, ys{plane.paper.y};
  for (const Mark& mark : plane.marks) {
    xs.push_back(mark.at.x);
    ys.push_back(mark.at.y);
  }
  for (const PlanePoint& point : plane.bound) ys.push_back(point.y);
  fit(plane.x, std::move(xs));
  fit(plane.y, std::move(ys));

  // Room for the list of the frontier at the right, which grows downward.
  plane.width_px = 1018;
  plane.height_px = std::max(620, int(220 + kListPitch_px * double(plane.frontier.size())));
  plane.x.low_px = 78;
  plane.x.high_px = 640;
  plane.y.low_px = plane.height_px - 68;
  plane.y.high_px = 30;
  return plane;
}

}  // namespace twocone::tradeoff
