// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/conclusions.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/tradeoff/axis_groups.h"

namespace twocone::tradeoff {
namespace {

/// A neighbour with fewer pairs than this share of what another origin has is passed over: it was swept as a detail.
constexpr double kLeastPairs = 0.25;
/// An interval that reaches this far from 1 (or as far on the other side) may hide what a person would pay for.
constexpr double kWorthSaying = 0.8;

struct AxisWords {
  std::string_view title, cost;
  bool is_sized;  ///< more of it is "beyond"
};
AxisWords words(Axis axis) {
  switch (axis) {
    case Axis::kSize:
      return {"image size", "simulation time", true};
    case Axis::kAntialias:
      return {"anti-aliasing", "simulation time", true};
    case Axis::kEffects:
      return {"effects", "simulation time", false};
    case Axis::kLevel:
      return {"estimator", "robot time", false};
    case Axis::kLandmarks:
      return {"landmarks", "robot time", true};
    case Axis::kBearings:
      return {"bearings", "robot time", false};
    case Axis::kRate:
      return {"frame rate", "robot time", true};
    case Axis::kFrames:
      return {"frames fused", "robot time", true};
  }
  return {};
}

using Pairs = std::vector<std::pair<const SettingResult*, const SettingResult*>>;

/// Geometric mean of what the second ones have over what the first ones have.
struct Ratio {
  double value = 0;
  double low = 0, high = 0;  ///< 95 %
  int pairs = 0;
};
template <typename Figure>
Ratio ratio_of(const Pairs& pairs, const Figure& figure) {
  std::vector<double> logs;
  double sum = 0, down_squares = 0, up_squares = 0;
  for (const auto& [first, second] : pairs) {
    const Interval a = figure(*first), b = figure(*second);
    const double log_ratio = std::log(b.value / a.value);
    if (!(a.value > 0 && b.value > 0 && std::isfinite(log_ratio))) continue;
    logs.push_back(log_ratio);
    sum += log_ratio;
    const auto square = [](double x) { return x * x; };
    down_squares += square(std::log(b.value / b.low)) + square(std::log(a.high / a.value));
    up_squares += square(std::log(b.high / b.value)) + square(std::log(a.value / a.low));
  }
  if (logs.empty()) return {};
  const double n = double(logs.size()), mean = sum / n;
  double scatter = 0;
  if (logs.size() > 1) {
    double squares = 0;
    for (const double x : logs) squares += (x - mean) * (x - mean);
    scatter = boost::math::quantile(boost::math::students_t(n - 1), 0.975) * std::sqrt(squares / (n - 1) / n);
  }
  const double down = std::max(scatter, std::sqrt(down_squares) / n), up = std::max(scatter, std::sqrt(up_squares) / n);
  return {std::exp(mean), std::exp(mean - down), std::exp(mean + up), int(logs.size())};
}

struct Step {
  const Setting *from, *to;  ///< examples of the two values
  Ratio error, cost;

  [[nodiscard]] bool tells() const { return error.high < 1 || error.low > 1; }
  [[nodiscard]] bool saves() const { return cost.pairs > 0 && cost.high < 1; }
  [[nodiscard]] bool buys_nothing() const { return !tells() && !saves(); }
};

Pairs pairs_between(const std::vector<AxisGroup>& groups, const AxisPlace& from, const AxisPlace& to) {
  Pairs pairs;
  for (const AxisGroup& group : groups) {
    const auto a = group.find(from), b = group.find(to);
    if (a != group.end() && b != group.end()) pairs.emplace_back(a->second, b->second);
  }
  return pairs;
}

/// The values that a step to `to` may come from, the best first: its neighbour below; of adaptive precision the
/// uniform one that it is to save time of; of other effects the scene's own.
std::vector<AxisPlace> origins(Axis axis, const std::vector<AxisPlace>& places, std::size_t to) {
  std::vector<AxisPlace> below(places.rend() - std::ptrdiff_t(to), places.rend());
  const auto put_first = [&below](double place) {
    std::stable_partition(below.begin(), below.end(), [place](const AxisPlace& p) { return p.first == place; });
  };
  if (axis == Axis::kLevel && places[to].first == double(Level::kAdaptive)) put_first(double(Level::kFine));
  if (axis == Axis::kEffects) put_first(double(Effects::kScene));
  return below;
}

std::vector<Step> steps_of(const Sweep& sweep, Axis axis) {
  const std::vector<AxisGroup> groups = axis_groups(sweep, axis);
  std::map<AxisPlace, const Setting*> examples;
  for (const AxisGroup& group : groups) {
    for (const auto& [place, result] : group) examples.emplace(place, &result->setting);
  }
  std::vector<AxisPlace> places;
  places.reserve(examples.size());
  for (const auto& [place, setting] : examples) places.push_back(place);
  const bool is_simulated = words(axis).cost == "simulation time";
  std::vector<Step> steps;
  for (std::size_t to = 1; to < places.size(); ++to) {
    std::size_t most = 0;
    const std::vector<AxisPlace> all = origins(axis, places, to);
    for (const AxisPlace& from : all) most = std::max(most, pairs_between(groups, from, places[to]).size());
    for (const AxisPlace& from : all) {
      const Pairs pairs = pairs_between(groups, from, places[to]);
      if (double(pairs.size()) < kLeastPairs * double(most)) continue;
      const Ratio error = ratio_of(pairs, [](const SettingResult& s) { return s.position_m->mean; });
      if (error.pairs == 0) continue;
      const Ratio cost = ratio_of(pairs, [is_simulated](const SettingResult& s) {
        return is_simulated ? s.simulation_time_s() : s.robot_time_s();
      });
      steps.push_back({examples[from], examples[places[to]], error, cost});
      break;
    }
  }
  return steps;
}

std::string number(double x, int digits) {
  if (x >= 10) return fmt::format("{:.0f}", x);
  return x < 0.095 ? fmt::format("{:.2g}", x) : fmt::format("{:.{}f}", x, digits);
}

/// "0.38 times (0.31 to 0.47, 22 pairs) for 3.7 times the simulation time"
std::string figures(const Step& step, Axis axis) {
  const Ratio& e = step.error;
  const std::string interval = e.low > 0 && std::isfinite(e.high)
                                   ? fmt::format("{} to {}", number(e.low, 2), number(e.high, 2))
                                   : "too few legs for an interval";
  std::string text =
      fmt::format("{} times ({}, {} {})", number(e.value, 2), interval, e.pairs, e.pairs == 1 ? "pair" : "pairs");
  if (step.cost.pairs > 0) {
    text += fmt::format(" for {} times the {}", number(step.cost.value, step.cost.value < 1 ? 2 : 1), words(axis).cost);
  }
  return text;
}

std::string from_to(const Step& step, Axis axis) {
  return fmt::format("from {} to {}", value(*step.from, axis), value(*step.to, axis));
}

std::string phrase(const Step& step, Axis axis) {
  const Ratio& e = step.error;
  std::string_view verdict;
  if (e.high < 1) {
    verdict = "the error falls to";
  } else if (e.low > 1) {
    verdict = "it costs accuracy: the error rises to";
  } else if (step.saves()) {
    verdict = e.high <= 1 / kWorthSaying ? "it costs no accuracy here: the error is"
                                         : "it costs no accuracy here that so few legs could show: the error is";
  } else {
    verdict = e.low >= kWorthSaying ? "it buys nothing here: the error is"
                                    : "it buys nothing here that so few legs could show: the error is";
  }
  return fmt::format("{} {} {}", from_to(step, axis), verdict, figures(step, axis));
}

/// Values of the axis that no setting with enough answers has: "160x120 answers in 40 % of the frames only".
std::vector<std::string> lost_values(const Sweep& sweep, Axis axis) {
  struct Value {
    std::string text;
    double frames = 0, answered = 0;
    bool is_left = false;
  };
  std::map<AxisPlace, Value> values;
  for (const SettingResult& s : sweep.settings) {
    Value& v = values[axis_place(s.setting, axis)];
    v.text = value(s.setting, axis);
    v.frames += s.frames;
    v.answered += s.answered;
    v.is_left = v.is_left || answers_enough(s);
  }
  std::vector<std::string> lost;
  for (const auto& [place, v] : values) {
    if (v.is_left) continue;
    lost.push_back(fmt::format("{} answers in {:.0f} % of the frames only", v.text,
                               v.frames > 0 ? std::floor(100 * v.answered / v.frames) : 0));
  }
  return lost;
}

std::string sentence_of(const Sweep& sweep, Axis axis) {
  const std::vector<Step> steps = steps_of(sweep, axis);
  const auto dear = [](const Step& step) { return step.buys_nothing() && step.error.low >= kWorthSaying; };
  std::size_t last = steps.size();
  while (last > 0 && dear(steps[last - 1])) --last;
  if (!words(axis).is_sized || last == 0) last = steps.size();
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i < last) {
      parts.push_back(phrase(steps[i], axis));
      continue;
    }
    const std::string beyond =
        i == last ? fmt::format("beyond {} it buys nothing here: ", value(*steps[i].from, axis)) : "";
    parts.push_back(fmt::format("{}{} the error is {}", beyond, from_to(steps[i], axis), figures(steps[i], axis)));
  }
  for (std::string& lost : lost_values(sweep, axis)) parts.push_back(std::move(lost));
  if (steps.empty()) parts.insert(parts.begin(), "no two settings that answer often enough differ in it alone");
  return fmt::format("{}: {}", words(axis).title, fmt::join(parts, "; "));
}

}  // namespace

std::vector<Conclusion> conclusions(const Sweep& sweep) {
  std::vector<Conclusion> all;
  for (const Axis axis : all_axes()) {
    const auto differs = [&](const SettingResult& s) {
      return axis_place(s.setting, axis) != axis_place(sweep.settings.front().setting, axis);
    };
    if (std::any_of(sweep.settings.begin(), sweep.settings.end(), differs)) {
      all.push_back({axis, sentence_of(sweep, axis)});
    }
  }
  return all;
}

}  // namespace twocone::tradeoff
