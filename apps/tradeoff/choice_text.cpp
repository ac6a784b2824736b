// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/choice_text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace twocone::tradeoff {
namespace {

using nlohmann::ordered_json;

ordered_json of(const Interval& interval) {
  return {{"value", interval.value}, {"low", interval.low}, {"high", interval.high}};
}

ordered_json of(const Sweep& sweep, const Trial& trial) {
  const SettingResult& swept = sweep.settings.at(trial.setting);
  ordered_json json{{"setting", trial.setting}, {"is", describe(swept.setting)}};
  if (swept.position_m) json["swept_mean_m"] = of(swept.position_m->mean);
  json["swept_robot_time_s"] = of(swept.robot_time_s());
  json["mean_m"] = of(trial.mean_m);
  json["upper_limit_m"] = trial.upper_limit_m;
  json["robot_time_s"] = of(trial.robot_time_s);
  json["holds"] = trial.holds;
  return json;
}

}  // namespace

std::string describe(const Wish& wish) {
  return wish.target_m ? fmt::format("mean position error below {:g} mm", 1e3 * *wish.target_m)
                       : fmt::format("vision and localisation below {:g} ms a frame", 1e3 * wish.budget_s.value_or(0));
}

std::string describe(const Sweep& sweep, const Trial& trial) {
  return fmt::format("{}: mean {:.3f} mm ({:.3f} to {:.3f}), upper limit {:.3f} mm; {:.1f} ms ({:.1f} to {:.1f}): {}",
                     describe(sweep.settings.at(trial.setting).setting), 1e3 * trial.mean_m.value,
                     1e3 * trial.mean_m.low, 1e3 * trial.mean_m.high, 1e3 * trial.upper_limit_m,
                     1e3 * trial.robot_time_s.value, 1e3 * trial.robot_time_s.low, 1e3 * trial.robot_time_s.high,
                     trial.holds ? "holds" : "does not hold");
}

std::string choice_json(const Sweep& sweep, const Wish& wish, const Choice& choice) {
  ordered_json json{{"version", sweep.version}, {"commit", sweep.commit}, {"sweep", sweep.repeat}};
  if (wish.target_m) json["target_m"] = *wish.target_m;
  if (wish.budget_s) json["budget_s"] = *wish.budget_s;
  json["settings_swept"] = sweep.settings.size();
  json["candidates"] = candidates(sweep, wish).size();
  json["trials"] = ordered_json::array();
  for (const Trial& trial : choice.trials) json["trials"].push_back(of(sweep, trial));
  json["choice"] = choice.setting ? ordered_json(*choice.setting) : ordered_json(nullptr);
  json["why"] = choice.why;
  return json.dump(2) + "\n";
}

std::vector<std::string> choice_header(const Sweep& sweep, const Wish& wish, const Choice& choice) {
  std::vector<std::string> lines{
      fmt::format("Chosen by twocone {}, commit {}, for: {}.", sweep.version, sweep.commit, describe(wish)),
      "  " + describe(sweep.settings.at(choice.setting.value()).setting), "Sweep: " + sweep.repeat};
  // A reason may have several sentences or lines; each line of a comment is its own.
  std::size_t begin = 0;
  while (begin < choice.why.size()) {
    const std::size_t end = std::min(choice.why.find('\n', begin), choice.why.size());
    lines.push_back(choice.why.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

}  // namespace twocone::tradeoff
