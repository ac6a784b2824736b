// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

constexpr double kListPitch_px = 17;

bool is_drawable(double value) { return std::isfinite(value) && value > 0; }

Interval cost_s(const SettingResult& result, Cost cost) {
  return cost == Cost::kRobotTime ? result.robot_time_s() : result.simulation_time_s();
}

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
  std::ranges::stable_sort(marks, {}, [](const Mark& mark) { return std::pair(mark.on_frontier, mark.at.x); });
  return marks;
}

double overlap(const Box& a, const Box& b) {
  const double width = std::min(a.right, b.right) - std::max(a.left, b.left);
  const double height = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}

bool is_inside(const Box& box, const Box& frame) {
  return box.left >= frame.left && box.right <= frame.right && box.top >= frame.top && box.bottom <= frame.bottom;
}

}  // namespace

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
  plane.paper = {kPaperTime_s / plane.unit_s, kPaperMeanError_m / kMm};

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

void Placing::keep_clear(Box box, double weight) { kept_.push_back({box, weight}); }

void Placing::keep_clear(Pixel from, Pixel to, double weight) {
  constexpr double kStep_px = 4, kHalf_px = 1.5;
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  const int steps = std::max(1, int(std::ceil(length / kStep_px)));
  for (int i = 0; i <= steps; ++i) {
    const double x = from.x + (to.x - from.x) * i / steps;
    const double y = from.y + (to.y - from.y) * i / steps;
    keep_clear({x - kHalf_px, y - kHalf_px, x + kHalf_px, y + kHalf_px}, weight);
  }
}

Pixel Placing::place(Pixel point, double width, double height) {
  // Directions in degrees, y downward. The area below and to the left of a frontier is empty.
  constexpr std::array<double, 16> kDirections{135, 157.5, 112.5, 180, 90, 202.5, 67.5,  225,
                                               45,  247.5, 22.5,  270, 0,  292.5, 337.5, 315};
  constexpr double kPenaltyPerPixel = 0.6, kPenaltyPerTurn = 0.05;
  double least = std::numeric_limits<double>::infinity();
  Box best{point.x - width / 2, point.y - height / 2, point.x + width / 2, point.y + height / 2};
  for (const double gap : {7.0, 11.0, 16.0, 22.0, 30.0, 40.0, 52.0}) {
    double turn = 0;
    for (const double degrees : kDirections) {
      const double angle = degrees * std::numbers::pi / 180;
      const double x = point.x + std::cos(angle) * (gap + width / 2);
      const double y = point.y + std::sin(angle) * (gap + height / 2);
      const Box box{x - width / 2, y - height / 2, x + width / 2, y + height / 2};
      turn += kPenaltyPerTurn;
      if (!is_inside(box, frame_)) continue;
      double penalty = gap * kPenaltyPerPixel + turn;
      for (const Kept& kept : kept_) penalty += kept.weight * overlap(box, kept.box);
      if (penalty < least) {
        least = penalty;
        best = box;
      }
    }
  }
  kept_.push_back({best, 5});
  return {(best.left + best.right) / 2, (best.top + best.bottom) / 2};
}

}  // namespace twocone::tradeoff
