// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/wording.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone::tradeoff {
namespace {

/// A step's origin with fewer pairs than this fraction of another origin's is skipped, because only details of it were
/// swept.
constexpr double kLeastPairs = 0.25;
/// An interval that extends below this number, or above its inverse, does not exclude a relevant effect.
constexpr double kLeastEffect = 0.8;

/// Returns groups of settings that differ in `axis` only, each group by rising place. Only settings that answer often
/// enough (kLeastAnswered) are included. The pointers refer to `sweep`.
using AxisGroup = std::map<AxisPlace, const SettingResult*>;
std::vector<AxisGroup> axis_groups(const Sweep& sweep, Axis axis) {
  std::map<std::vector<AxisPlace>, AxisGroup> groups;  // by the places on all other axes
  for (const SettingResult& result : sweep.settings) {
    if (!answers_enough(result)) continue;
    std::vector<AxisPlace> others;
    for (const Axis other : kAllAxes) {
      if (other != axis) others.push_back(facts_of(other).place(result.setting));
    }
    groups[others].emplace(facts_of(axis).place(result.setting), &result);
  }
  std::vector<AxisGroup> of_two_or_more;
  for (auto& [others, group] : groups) {
    if (group.size() > 1) of_two_or_more.push_back(std::move(group));
  }
  return of_two_or_more;
}

/// Returns the name of the time that a step on the axis costs.
std::string_view cost_name(Axis axis) { return facts_of(axis).costs_rendering ? "simulation time" : "robot time"; }

using Pairs = std::vector<std::pair<const SettingResult*, const SettingResult*>>;

/// Geometric mean, over pairs of settings, of the second one's figure divided by the first one's.
struct Ratio {
  double value = 0;
  double low = 0, high = 0;  ///< 95 % interval; 0 or infinity if there are too few episodes for that end
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
    scatter = students_t(n - 1, 0.975) * std::sqrt(squares / (n - 1) / n);
  }
  const double down = std::max(scatter, std::sqrt(down_squares) / n), up = std::max(scatter, std::sqrt(up_squares) / n);
  return {std::exp(mean), std::exp(mean - down), std::exp(mean + up), int(logs.size())};
}

struct Step {
  const Setting *from, *to;  ///< examples of the two values
  Ratio error, cost;

  [[nodiscard]] bool has_effect() const { return error.high < 1 || error.low > 1; }
  [[nodiscard]] bool has_interval() const { return error.low > 0 && std::isfinite(error.high); }
  /// Returns whether the interval excludes all relevant effects.
  [[nodiscard]] bool is_narrow() const { return error.low >= kLeastEffect && error.high <= 1 / kLeastEffect; }
  [[nodiscard]] bool saves() const { return cost.pairs > 0 && cost.high < 1; }
  /// Returns whether no effect on the error and no saving was found, and a relevant gain is excluded.
  [[nodiscard]] bool gains_nothing() const { return !has_effect() && !saves() && error.low >= kLeastEffect; }
};

Pairs pairs_between(const std::vector<AxisGroup>& groups, const AxisPlace& from, const AxisPlace& to) {
  Pairs pairs;
  for (const AxisGroup& group : groups) {
    const auto a = group.find(from), b = group.find(to);
    if (a != group.end() && b != group.end()) pairs.emplace_back(a->second, b->second);
  }
  return pairs;
}

/// Returns the values at which a step to `to` may begin, the best first. The best one is the neighbour below; for
/// adaptive precision, it is the uniform one whose time it should save; for other effects, it is those of the scene.
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
  const bool is_simulated = facts_of(axis).costs_rendering;
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

/// Returns "0.31 to 0.47, 22 pairs"; "at least 0.31" without an upper limit, "at most 0.47" without a lower one.
std::string interval(const Ratio& ratio) {
  const bool has_low = ratio.low > 0, has_high = std::isfinite(ratio.high);
  const std::string limits = has_low && has_high ? fmt::format("{} to {}", number(ratio.low, 2), number(ratio.high, 2))
                             : has_low           ? fmt::format("at least {}", number(ratio.low, 2))
                             : has_high          ? fmt::format("at most {}", number(ratio.high, 2))
                                                 : "too few episodes for an interval";
  return fmt::format("{}, {} {}", limits, ratio.pairs, ratio.pairs == 1 ? "pair" : "pairs");
}

/// Returns "0.38 times (0.31 to 0.47, 22 pairs)".
std::string times(const Ratio& ratio) { return fmt::format("{} times ({})", number(ratio.value, 2), interval(ratio)); }

/// Returns " at 3.7 times the simulation time"; empty without times.
std::string at_cost(const Step& step, Axis axis) {
  if (step.cost.pairs == 0) return "";
  return fmt::format(" at {} times the {}", number(step.cost.value, step.cost.value < 1 ? 2 : 1), cost_name(axis));
}

std::string from_to(const Step& step, Axis axis) {
  return fmt::format("from {} to {}", facts_of(axis).value(*step.from), facts_of(axis).value(*step.to));
}

std::string phrase(const Step& step, Axis axis) {
  const Ratio& e = step.error;
  std::string effect;
  if (step.has_effect()) {
    effect = fmt::format("the error {} to {}", e.high < 1 ? "falls" : "rises", times(e));
  } else if (!step.has_interval()) {
    effect = fmt::format("the measured error is {}", times(e));
  } else {
    effect = fmt::format("no effect on the error was found{} (factor {}, {})",
                         step.is_narrow() ? "" : ", but the data do not exclude one", number(e.value, 2), interval(e));
  }
  return fmt::format("{} {}{}", from_to(step, axis), effect, at_cost(step, axis));
}

/// Returns a text for each value of the axis for which no setting answers often enough: "160x120 answers in only 40 %
/// of the frames".
std::vector<std::string> lost_values(const Sweep& sweep, Axis axis) {
  struct Value {
    std::string text;
    double frames = 0, answered = 0;
    bool is_left = false;
  };
  std::map<AxisPlace, Value> values;
  for (const SettingResult& s : sweep.settings) {
    Value& v = values[facts_of(axis).place(s.setting)];
    v.text = facts_of(axis).value(s.setting);
    v.frames += s.frames;
    v.answered += s.answered;
    v.is_left = v.is_left || answers_enough(s);
  }
  std::vector<std::string> lost;
  for (const auto& [place, v] : values) {
    if (v.is_left) continue;
    lost.push_back(fmt::format("{} answers in only {:.0f} % of the frames", v.text,
                               v.frames > 0 ? std::floor(100 * v.answered / v.frames) : 0));
  }
  return lost;
}

std::string sentence_of(const Sweep& sweep, Axis axis) {
  const std::vector<Step> steps = steps_of(sweep, axis);
  std::size_t last = steps.size();
  while (last > 0 && steps[last - 1].gains_nothing()) --last;
  if (!facts_of(axis).is_sized || last == 0) last = steps.size();
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i < last) {
      parts.push_back(phrase(steps[i], axis));
      continue;
    }
    const std::string beyond =
        i == last ? fmt::format("beyond {} no gain in accuracy was found: ", facts_of(axis).value(*steps[i].from)) : "";
    parts.push_back(fmt::format("{}{} the error is {}{}", beyond, from_to(steps[i], axis), times(steps[i].error),
                                at_cost(steps[i], axis)));
  }
  for (std::string& lost : lost_values(sweep, axis)) parts.push_back(std::move(lost));
  if (steps.empty()) parts.insert(parts.begin(), "no two settings that answer often enough differ in this axis only");
  return fmt::format("{}: {}", facts_of(axis).title, fmt::join(parts, "; "));
}

// ---- growth

/// Added in quadrature to each point's own sigma. No law is more accurate, and a point without scatter would otherwise
/// outweigh all others.
constexpr double kLeastSigma = 0.01;

struct Point {
  double x = 0, y = 0;  ///< logarithms
  double weight = 0;
};

std::vector<Point> points_of(const AxisGroup& group, const std::function<Interval(const SettingResult&)>& figure) {
  const double z = normal_quantile((1 + kConfidence) / 2);
  std::vector<Point> points;
  for (const auto& [place, result] : group) {
    const Interval f = figure(*result);
    if (!(f.low > 0 && std::isfinite(f.high) && place.first > 0)) continue;
    const double sigma = std::log(f.high / f.low) / (2 * z);
    points.push_back({std::log(place.first), std::log(f.value), 1 / (sigma * sigma + kLeastSigma * kLeastSigma)});
  }
  return points;
}

/// Fits one exponent to all groups, each with its own factor.
std::optional<Growth> fit(const std::vector<std::vector<Point>>& groups) {
  double xx = 0, xy = 0, yy = 0;
  int points = 0, used = 0;
  for (const auto& group : groups) {
    const auto differs = [&group](const Point& p) { return p.x != group.front().x; };
    if (std::none_of(group.begin(), group.end(), differs)) continue;
    double weights = 0, x = 0, y = 0;
    for (const Point& p : group) {
      weights += p.weight;
      x += p.weight * p.x;
      y += p.weight * p.y;
    }
    x /= weights;
    y /= weights;
    for (const Point& p : group) {
      xx += p.weight * (p.x - x) * (p.x - x);
      xy += p.weight * (p.x - x) * (p.y - y);
      yy += p.weight * (p.y - y) * (p.y - y);
    }
    points += int(group.size());
    ++used;
  }
  if (used == 0) return std::nullopt;
  Growth growth;
  growth.exponent = xy / xx;
  growth.points = points;
  double half = normal_quantile((1 + kConfidence) / 2) / std::sqrt(xx);
  if (const int freedom = points - used - 1; freedom > 0) {
    // If the growth is not a power law, the points scatter about the law by more than their own intervals.
    const double scatter = std::max(0.0, yy - growth.exponent * xy) / freedom;
    half = std::max(half, students_t(freedom, (1 + kConfidence) / 2) * std::sqrt(scatter / xx));
  }
  growth.low = growth.exponent - half;
  growth.high = growth.exponent + half;
  return growth;
}

/// Returns one setting for each set of images, with default values except the images. One is enough, because the
/// rendering of a set is timed once for all its settings.
Sweep of_images(const Sweep& sweep) {
  Sweep images;
  std::set<Images> seen;
  for (SettingResult result : sweep.settings) {
    if (!answers_enough(result) || !seen.insert(result.setting.images).second) continue;
    result.setting = {.images = result.setting.images};
    images.settings.push_back(result);
  }
  return images;
}

}  // namespace

std::map<Axis, std::string> conclusions(const Sweep& sweep) {
  std::map<Axis, std::string> all;
  for (const Axis axis : kAllAxes) {
    const auto differs = [&](const SettingResult& s) {
      return facts_of(axis).place(s.setting) != facts_of(axis).place(sweep.settings.front().setting);
    };
    if (std::any_of(sweep.settings.begin(), sweep.settings.end(), differs)) all[axis] = sentence_of(sweep, axis);
  }
  return all;
}

std::vector<Growth> growth(const Sweep& sweep) {
  const auto error = [](const SettingResult& s) { return s.position_m->mean; };
  const auto vision = [](const SettingResult& s) { return s.vision.median_s; };
  const auto rendering = [](const SettingResult& s) { return s.render_cpu.median_s; };
  const Sweep images = of_images(sweep);
  struct Law {
    const Sweep& sweep;
    Axis axis;
    const char* of;
    std::function<Interval(const SettingResult&)> figure;
  };
  std::vector<Growth> all;
  for (const Law& law :
       {Law{sweep, Axis::kSize, "position error", error}, Law{sweep, Axis::kSize, "vision time", vision},
        Law{images, Axis::kSize, "rendering time", rendering}, Law{sweep, Axis::kLandmarks, "position error", error},
        Law{sweep, Axis::kLandmarks, "vision time", vision}, Law{sweep, Axis::kFrames, "position error", error}}) {
    std::vector<std::vector<Point>> points;
    for (const AxisGroup& group : axis_groups(law.sweep, law.axis)) points.push_back(points_of(group, law.figure));
    if (auto found = fit(points)) {
      found->axis = law.axis;
      found->of = law.of;
      all.push_back(*found);
    }
  }
  return all;
}

}  // namespace twocone::tradeoff
