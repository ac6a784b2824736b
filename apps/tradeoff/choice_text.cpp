// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/choice_text.h"

#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace twocone::tradeoff {
namespace {

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

std::string describe(const Requirement& requirement) {
  return requirement.goal == Goal::kTarget
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
  json[requirement.goal == Goal::kTarget ? "target_m" : "budget_s"] = requirement.limit;
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
