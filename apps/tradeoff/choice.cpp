// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/tradeoff/axis_groups.h"

namespace twocone::tradeoff {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLevel = 0.95;

void check(const Wish& wish) {
  if (wish.target_m.has_value() == wish.budget_s.has_value()) {
    throw std::invalid_argument("choice: the wish is none or two, must be a target or a budget");
  }
  const double bound = wish.target_m ? *wish.target_m : *wish.budget_s;
  if (bound > 0 && std::isfinite(bound)) return;
  throw std::invalid_argument(
      fmt::format("choice: {} is {}, must be positive and finite", wish.target_m ? "target_m" : "budget_s", bound));
}

const Interval& mean_m(const SettingResult& s) { return s.position_m->mean; }

bool can_be_had(const SettingResult& s) { return s.setting.pictures.effects == Effects::kScene && answers_enough(s); }

Trial judge(const Check& fresh, const Wish& wish, std::size_t settings_swept) {
  constexpr Interval kUnknown{kInfinity, 0, kInfinity};
  const auto has_values = [](const std::vector<double>& leg) { return !leg.empty(); };
  const auto legs_of = [&](const ByLeg& values) { return std::count_if(values.begin(), values.end(), has_values); };
  Trial trial;
  trial.legs = int(legs_of(fresh.position_errors_m));
  trial.mean_m = trial.robot_time_s = kUnknown;
  trial.upper_limit_m = kInfinity;
  if (trial.legs > 0) {
    trial.mean_m = mean_interval(fresh.position_errors_m, kLevel);
    trial.upper_limit_m = mean_upper_limit(fresh.position_errors_m, 1 - (1 - kLevel) / double(settings_swept));
  }
  if (legs_of(fresh.robot_times_s) > 0) trial.robot_time_s = quantile_interval(fresh.robot_times_s, 0.95, kLevel);
  trial.answered_share = fresh.answered_share;
  const bool is_within =
      wish.target_m ? trial.upper_limit_m < *wish.target_m : trial.robot_time_s.high < *wish.budget_s;
  trial.holds = is_within && trial.answered_share >= kLeastAnswered;
  return trial;
}

std::string milli(double x) { return std::isfinite(x) ? fmt::format("{:.3g}", x * 1e3) : "any"; }

std::string number_of(std::size_t n, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

/// Why a setting that is cheaper (more accurate) was not even tried, as counts.
struct PassedOver {
  std::size_t beyond = 0, rarely = 0, elsewhere = 0;

  [[nodiscard]] std::string text(std::string_view are, const Wish& wish) const {
    std::vector<std::string> parts;
    if (beyond > 0) {
      parts.push_back(
          wish.target_m
              ? fmt::format("{} a mean of {} mm or more", number_of(beyond, "has", "have"), milli(*wish.target_m))
              : fmt::format("{} {} ms or more", number_of(beyond, "takes", "take"), milli(*wish.budget_s)));
    }
    if (rarely > 0) {
      parts.push_back(fmt::format("{} less often than in {:.0f} % of the frames",
                                  number_of(rarely, "answers", "answer"), 100 * kLeastAnswered));
    }
    if (elsewhere > 0) {
      parts.push_back(
          fmt::format("{} pictures of another world than the scene's", number_of(elsewhere, "is for", "are for")));
    }
    if (parts.empty()) return "";
    return fmt::format("; of the others that are {}, {}", are, fmt::join(parts, ", "));
  }
};

class Reasons {
 public:
  Reasons(const Sweep& sweep, const Wish& wish, const Choice& choice) : sweep_(sweep), wish_(wish), choice_(choice) {}

  [[nodiscard]] std::string chosen() const {
    const Trial& t = choice_.trials.back();
    const std::string_view better = wish_.target_m ? "cheaper" : "more accurate";
    std::string text = fmt::format("{}: {}", describe(sweep_.settings[t.setting].setting), figures(t));
    if (const std::size_t failed = choice_.trials.size() - 1; failed > 0) {
      text += fmt::format("; {} before it, from the {} on, and did not hold",
                          number_of(failed, "setting was tried", "settings were tried"),
                          wish_.target_m ? "cheapest" : "most accurate");
    }
    return text + passed_over(t.setting).text(better, wish_);
  }

  [[nodiscard]] std::string none() const {
    if (!choice_.trials.empty()) {
      const Trial& nearest =
          *std::min_element(choice_.trials.begin(), choice_.trials.end(),
                            [this](const Trial& a, const Trial& b) { return distance(a) < distance(b); });
      return fmt::format(
          "none holds: of {}, nearest comes {}: {}; no other setting that answers often enough is below it in the "
          "sweep",
          number_of(choice_.trials.size(), "setting tried", "settings tried"),
          describe(sweep_.settings[nearest.setting].setting), figures(nearest));
    }
    const SettingResult* nearest = nullptr;
    const auto wanted = [this](const SettingResult& s) { return wish_.target_m ? mean_m(s) : s.robot_time_s(); };
    for (const SettingResult& s : sweep_.settings) {
      if (can_be_had(s) && (!nearest || wanted(s).value < wanted(*nearest).value)) nearest = &s;
    }
    if (!nearest) {
      return fmt::format("none holds: no setting of the scene's own world answers in {:.0f} % of the frames",
                         100 * kLeastAnswered);
    }
    const Interval w = wanted(*nearest);
    return fmt::format("none holds: no {} of the sweep is below {} {}; nearest comes {} with {} {} ({} to {})",
                       wish_.target_m ? "mean position error" : "time of a frame", milli(bound()), unit(),
                       describe(nearest->setting), milli(w.value), unit(), milli(w.low), milli(w.high));
  }

 private:
  [[nodiscard]] double bound() const { return wish_.target_m ? *wish_.target_m : *wish_.budget_s; }
  [[nodiscard]] std::string_view unit() const { return wish_.target_m ? "mm" : "ms"; }
  [[nodiscard]] double distance(const Trial& t) const { return wish_.target_m ? t.upper_limit_m : t.robot_time_s.high; }

  [[nodiscard]] std::string figures(const Trial& t) const {
    const std::string legs = fmt::format("on {} fresh {}", t.legs, t.legs == 1 ? "leg" : "legs");
    const std::string_view side = distance(t) < bound() ? "below" : "not below";
    std::string text;
    if (wish_.target_m) {
      text = fmt::format("{} mm {}, upper limit {} mm (1 - 0.05/{}) {} {} mm, {} ms a frame", milli(t.mean_m.value),
                         legs, milli(t.upper_limit_m), sweep_.settings.size(), side, milli(bound()),
                         milli(t.robot_time_s.value));
    } else {
      text = fmt::format("{} ms a frame (95 % quantile) {}, upper limit {} ms {} {} ms, {} mm ({} to {})",
                         milli(t.robot_time_s.value), legs, milli(t.robot_time_s.high), side, milli(bound()),
                         milli(t.mean_m.value), milli(t.mean_m.low), milli(t.mean_m.high));
    }
    if (t.answered_share < kLeastAnswered) {
      text += fmt::format(", but it answers in {:.0f} % of the frames only", std::floor(100 * t.answered_share));
    }
    return text;
  }

  /// Settings that are cheaper (more accurate) than the chosen one by more than both intervals, and no candidates.
  [[nodiscard]] PassedOver passed_over(std::size_t chosen) const {
    const std::vector<std::size_t> tried_or_later = candidates(sweep_, wish_);
    const SettingResult& choice = sweep_.settings[chosen];
    PassedOver counts;
    for (std::size_t i = 0; i < sweep_.settings.size(); ++i) {
      const SettingResult& s = sweep_.settings[i];
      if (std::find(tried_or_later.begin(), tried_or_later.end(), i) != tried_or_later.end()) continue;
      const bool is_better = wish_.target_m ? s.robot_time_s().high < choice.robot_time_s().low
                                            : s.position_m && mean_m(s).high < mean_m(choice).low;
      if (!is_better) continue;
      ++(s.setting.pictures.effects != Effects::kScene ? counts.elsewhere
         : !answers_enough(s)                          ? counts.rarely
                                                       : counts.beyond);
    }
    return counts;
  }

  const Sweep& sweep_;
  const Wish& wish_;
  const Choice& choice_;
};

}  // namespace

std::vector<std::size_t> candidates(const Sweep& sweep, const Wish& wish) {
  check(wish);
  using Place = std::tuple<double, double, std::size_t>;
  std::vector<Place> places;
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    const SettingResult& s = sweep.settings[i];
    if (!can_be_had(s)) continue;
    const double error_m = mean_m(s).value, time_s = s.robot_time_s().value;
    if (wish.target_m ? error_m < *wish.target_m && std::isfinite(time_s)
                      : time_s < *wish.budget_s && std::isfinite(error_m)) {
      places.push_back(wish.target_m ? Place{time_s, error_m, i} : Place{error_m, time_s, i});
    }
  }
  std::sort(places.begin(), places.end());
  std::vector<std::size_t> order;
  order.reserve(places.size());
  for (const Place& place : places) order.push_back(std::get<2>(place));
  return order;
}

Result<Choice> choose(const Sweep& sweep, const Wish& wish,
                      const std::function<Result<Check>(const Setting&)>& check_setting) {
  Choice choice;
  for (const std::size_t i : candidates(sweep, wish)) {
    const Result<Check> fresh = check_setting(sweep.settings[i].setting);
    if (!fresh) return fresh.error();
    choice.trials.push_back(judge(*fresh, wish, sweep.settings.size()));
    choice.trials.back().setting = i;
    if (!choice.trials.back().holds) continue;
    choice.setting = i;
    break;
  }
  const Reasons reasons(sweep, wish, choice);
  choice.why = choice.setting ? reasons.chosen() : reasons.none();
  return choice;
}

}  // namespace twocone::tradeoff
