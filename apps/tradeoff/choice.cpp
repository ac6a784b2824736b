// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace twocone::tradeoff {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

const Interval& mean_m(const SettingResult& s) { return s.position_m->mean; }

bool can_be_had(const SettingResult& s) { return s.setting.images.effects == Effects::kScene && answers_enough(s); }

bool is_target(const Requirement& requirement) { return requirement.goal == Goal::kTarget; }

/// Returns the upper limit of the number that the requirement limits.
double upper_limit(const Validation& t, const Requirement& requirement) {
  return is_target(requirement) ? t.upper_limit_m : t.robot_time_s.high;
}

Validation judge(const Check& fresh, const Requirement& requirement, std::size_t settings_swept) {
  constexpr Interval kUnknown{kInfinity, 0, kInfinity};
  const auto episodes_of = [](const ByEpisode& values) {
    return std::ranges::count_if(values, [](const std::vector<double>& episode) { return !episode.empty(); });
  };
  Validation validation;
  validation.episodes = int(episodes_of(fresh.position_errors_m));
  validation.mean_m = validation.robot_time_s = kUnknown;
  validation.upper_limit_m = kInfinity;
  if (validation.episodes > 0) {
    validation.mean_m = mean_interval(fresh.position_errors_m, kConfidence);
    validation.upper_limit_m =
        mean_upper_limit(fresh.position_errors_m, 1 - (1 - kConfidence) / double(settings_swept));
  }
  if (episodes_of(fresh.robot_times_s) > 0)
    validation.robot_time_s = quantile_interval(fresh.robot_times_s, 0.95, kConfidence);
  validation.answered_share = fresh.answered_share;
  validation.is_confirmed =
      upper_limit(validation, requirement) < requirement.limit && validation.answered_share >= kLeastAnswered;
  return validation;
}

std::string milli(double x) { return std::isfinite(x) ? fmt::format("{:.3g}", x * 1e3) : "unknown"; }

std::string number_of(std::size_t n, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

class Reasons {
 public:
  Reasons(const Sweep& sweep, const Requirement& requirement, const Choice& choice)
      : sweep_(sweep), requirement_(requirement), choice_(choice) {}

  [[nodiscard]] std::string chosen() const {
    const Validation& t = choice_.validations.back();
    std::string text = fmt::format("{}: {}", describe(sweep_.settings[t.setting].setting), figures(t));
    if (const std::size_t failed = choice_.validations.size() - 1; failed > 0) {
      text += fmt::format("; {} before it, beginning with the {}, and not confirmed",
                          number_of(failed, "setting was tested", "settings were tested"),
                          has_target() ? "cheapest" : "most accurate");
    }
    return text + passed_over(t.setting);
  }

  [[nodiscard]] std::string none() const {
    if (!choice_.validations.empty()) {
      const Validation& nearest = *std::ranges::min_element(
          choice_.validations, {}, [this](const Validation& v) { return upper_limit(v, requirement_); });
      return fmt::format(
          "no setting is confirmed: of {}, the nearest is {}: {}; no other setting that answers often enough meets the "
          "requirement in the sweep",
          number_of(choice_.validations.size(), "setting tested", "settings tested"),
          describe(sweep_.settings[nearest.setting].setting), figures(nearest));
    }
    const SettingResult* nearest = nullptr;
    const auto wanted = [this](const SettingResult& s) { return has_target() ? mean_m(s) : s.robot_time_s(); };
    for (const SettingResult& s : sweep_.settings) {
      if (can_be_had(s) && (!nearest || wanted(s).value < wanted(*nearest).value)) nearest = &s;
    }
    if (!nearest) {
      return fmt::format("no setting is confirmed: none with the scene's own effects answers in {:.0f} % of the frames",
                         100 * kLeastAnswered);
    }
    const Interval w = wanted(*nearest);
    return fmt::format(
        "no setting is confirmed: no {} of the sweep is below {} {}; the nearest is {} with {} {} ({} to {})",
        has_target() ? "mean position error" : "time of a frame", milli(requirement_.limit), unit(),
        describe(nearest->setting), milli(w.value), unit(), milli(w.low), milli(w.high));
  }

 private:
  [[nodiscard]] bool has_target() const { return is_target(requirement_); }
  [[nodiscard]] std::string_view unit() const { return has_target() ? "mm" : "ms"; }

  [[nodiscard]] std::string figures(const Validation& t) const {
    const std::string episodes = fmt::format("on {} fresh {}", t.episodes, t.episodes == 1 ? "episode" : "episodes");
    const std::string_view side = upper_limit(t, requirement_) < requirement_.limit ? "below" : "not below";
    std::string text;
    if (has_target()) {
      text = fmt::format("{} mm {}, upper limit {} mm (1 - 0.05/{}) {} {} mm, {} ms per frame", milli(t.mean_m.value),
                         episodes, milli(t.upper_limit_m), sweep_.settings.size(), side, milli(requirement_.limit),
                         milli(t.robot_time_s.value));
    } else {
      text = fmt::format("{} ms per frame (95 % quantile) {}, upper limit {} ms {} {} ms, {} mm ({} to {})",
                         milli(t.robot_time_s.value), episodes, milli(t.robot_time_s.high), side,
                         milli(requirement_.limit), milli(t.mean_m.value), milli(t.mean_m.low), milli(t.mean_m.high));
    }
    if (t.answered_share < kLeastAnswered) {
      text += fmt::format(", but it answers in only {:.0f} % of the frames", std::floor(100 * t.answered_share));
    }
    return text;
  }

  /// Returns the number of settings, by reason, that are cheaper (more accurate) than the chosen one by more than both
  /// intervals but are not candidates.
  [[nodiscard]] std::string passed_over(std::size_t chosen) const {
    const std::vector<std::size_t> tried_or_later = candidates(sweep_, requirement_);
    const SettingResult& choice = sweep_.settings[chosen];
    std::size_t beyond = 0, rarely = 0, elsewhere = 0;
    for (std::size_t i = 0; i < sweep_.settings.size(); ++i) {
      const SettingResult& s = sweep_.settings[i];
      if (std::ranges::find(tried_or_later, i) != tried_or_later.end()) continue;
      const bool is_better = has_target() ? s.robot_time_s().high < choice.robot_time_s().low
                                          : s.position_m && mean_m(s).high < mean_m(choice).low;
      if (!is_better) continue;
      ++(s.setting.images.effects != Effects::kScene ? elsewhere : !answers_enough(s) ? rarely : beyond);
    }
    std::vector<std::string> parts;
    if (beyond > 0) {
      parts.push_back(fmt::format(
          "{} {} {} or more",
          has_target() ? number_of(beyond, "has a mean of", "have a mean of") : number_of(beyond, "takes", "take"),
          milli(requirement_.limit), unit()));
    }
    if (rarely > 0) {
      parts.push_back(fmt::format("{} less often than in {:.0f} % of the frames",
                                  number_of(rarely, "answers", "answer"), 100 * kLeastAnswered));
    }
    if (elsewhere > 0) {
      parts.push_back(
          fmt::format("{} images with other effects than the scene's", number_of(elsewhere, "is for", "are for")));
    }
    if (parts.empty()) return "";
    return fmt::format("; of the others that are {}, {}", has_target() ? "cheaper" : "more accurate",
                       fmt::join(parts, ", "));
  }

  const Sweep& sweep_;
  const Requirement& requirement_;
  const Choice& choice_;
};

using nlohmann::ordered_json;

ordered_json of(const Interval& interval) {
  return {{"value", interval.value}, {"low", interval.low}, {"high", interval.high}};
}

ordered_json of(const Sweep& sweep, const Validation& validation) {
  const SettingResult& swept = sweep.settings.at(validation.setting);
  ordered_json json{{"setting", validation.setting}, {"is", describe(swept.setting)}};
  if (swept.position_m) json["swept_mean_m"] = of(swept.position_m->mean);
  json["swept_robot_time_s"] = of(swept.robot_time_s());
  json["mean_m"] = of(validation.mean_m);
  json["upper_limit_m"] = validation.upper_limit_m;
  json["robot_time_s"] = of(validation.robot_time_s);
  json["holds"] = validation.is_confirmed;
  return json;
}

}  // namespace

std::vector<std::size_t> candidates(const Sweep& sweep, const Requirement& requirement) {
  std::vector<std::tuple<double, double, std::size_t>> places;
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    const SettingResult& s = sweep.settings[i];
    if (!can_be_had(s)) continue;
    double limited = mean_m(s).value, least = s.robot_time_s().value;
    if (!is_target(requirement)) std::swap(limited, least);
    if (limited < requirement.limit && std::isfinite(least)) places.emplace_back(least, limited, i);
  }
  std::sort(places.begin(), places.end());
  std::vector<std::size_t> order;
  order.reserve(places.size());
  for (const auto& place : places) order.push_back(std::get<2>(place));
  return order;
}

Result<Choice> choose(const Sweep& sweep, const Requirement& requirement,
                      const std::function<Result<Check>(const Setting&)>& check_setting) {
  Choice choice;
  for (const std::size_t i : candidates(sweep, requirement)) {
    const Result<Check> fresh = check_setting(sweep.settings[i].setting);
    if (!fresh) return fresh.error();
    choice.validations.push_back(judge(*fresh, requirement, sweep.settings.size()));
    choice.validations.back().setting = i;
    if (!choice.validations.back().is_confirmed) continue;
    choice.setting = i;
    break;
  }
  const Reasons reasons(sweep, requirement, choice);
  choice.why = choice.setting ? reasons.chosen() : reasons.none();
  return choice;
}

std::string describe(const Requirement& requirement) {
  return is_target(requirement)
             ? fmt::format("mean position error below {:g} mm", 1e3 * requirement.limit)
             : fmt::format("vision and localisation below {:g} ms per frame", 1e3 * requirement.limit);
}

std::string describe(const Sweep& sweep, const Validation& validation) {
  return fmt::format("{}: mean {:.3f} mm ({:.3f} to {:.3f}), upper limit {:.3f} mm; {:.1f} ms ({:.1f} to {:.1f}): {}",
                     describe(sweep.settings.at(validation.setting).setting), 1e3 * validation.mean_m.value,
                     1e3 * validation.mean_m.low, 1e3 * validation.mean_m.high, 1e3 * validation.upper_limit_m,
                     1e3 * validation.robot_time_s.value, 1e3 * validation.robot_time_s.low,
                     1e3 * validation.robot_time_s.high, validation.is_confirmed ? "confirmed" : "not confirmed");
}

std::string choice_json(const Sweep& sweep, const Requirement& requirement, const Choice& choice) {
  ordered_json json{{"version", sweep.version}, {"commit", sweep.commit}, {"sweep", sweep.repeat}};
  json[is_target(requirement) ? "target_m" : "budget_s"] = requirement.limit;
  json["settings_swept"] = sweep.settings.size();
  json["candidates"] = candidates(sweep, requirement).size();
  json["validations"] = ordered_json::array();
  for (const Validation& validation : choice.validations) json["validations"].push_back(of(sweep, validation));
  json["choice"] = choice.setting ? ordered_json(*choice.setting) : ordered_json(nullptr);
  json["why"] = choice.why;
  return json.dump(2) + "\n";
}

std::vector<std::string> choice_header(const Sweep& sweep, const Requirement& requirement, const Choice& choice) {
  std::vector<std::string> lines{
      fmt::format("Chosen by twocone {}, commit {}, for: {}.", sweep.version, sweep.commit, describe(requirement)),
      "  " + describe(sweep.settings.at(choice.setting.value()).setting), "Sweep: " + sweep.repeat};
  // A reason may have several lines; each one is a line of the comment.
  std::istringstream why(choice.why);
  for (std::string line; std::getline(why, line);) lines.push_back(line);
  return lines;
}

}  // namespace twocone::tradeoff
