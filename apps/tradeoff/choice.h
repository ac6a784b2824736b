// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"
#include "hal/result.h"

namespace twocone::tradeoff {

enum class Goal {
  kTarget,  ///< the cheapest setting (by robot_time_s()) with a mean position error below the limit
  kBudget,  ///< the most accurate setting with a robot_time_s() below the limit
};
/// The requirement on a setting.
struct Requirement {
  Goal goal;
  double limit;  ///< metres or seconds, finite and > 0
};

/// Errors and times of a setting on fresh episodes, which the sweep did not use.
struct Check {
  ByEpisode position_errors_m;
  ByEpisode robot_times_s;    ///< vision and localisation of one frame together
  double answered_share = 0;  ///< 0 to 1
};

/// The judgement of a check against a requirement.
struct Validation {
  std::size_t setting = 0;   ///< index in Sweep::settings
  int episodes = 0;          ///< number of fresh episodes with an answer
  Interval mean_m;           ///< mean position error on the fresh episodes, 95 %; infinite without an answer
  double upper_limit_m = 0;  ///< its one-sided upper limit, level 1 - 0.05 / number of settings swept; likewise
  Interval robot_time_s;     ///< 95 % quantile and its 95 % interval on the fresh episodes; infinite without times
  double answered_share = 0;
  bool is_confirmed = false;  ///< whether the upper limit meets the requirement and enough frames have an answer
};

struct Choice {
  std::optional<std::size_t> setting;   ///< index in Sweep::settings; empty if none is confirmed
  std::vector<Validation> validations;  ///< in order; the last one is the choice if there is one
  std::string why;                      ///< the reason in a sentence
};

/// Returns the settings that are worth a check, in order. For a target, they are the settings whose mean is below it,
/// the cheapest first. For a time budget, they are the settings whose robot_time_s() is below it, the most accurate
/// first. Equal ones are ordered by the other number. Only settings that a robot can have (Effects::kScene) and that
/// answer often enough are included. All others of this kind exceed the limit in the sweep already.
std::vector<std::size_t> candidates(const Sweep& sweep, const Requirement& requirement);

/// Checks candidates until one is confirmed on fresh episodes. For a target, the upper 95 % confidence limit of the
/// mean position error must be below the target; its level is divided by the number of settings swept (Bonferroni). For
/// a time budget, the upper limit of the 95 % interval of the time's 95 % quantile must be below the budget. The
/// setting must also answer often enough (kLeastAnswered). So each cheaper (more accurate) candidate was checked and
/// not confirmed.
/// @param check_setting returns errors and times of a setting on fresh episodes. An error ends the search; it is
/// returned
Result<Choice> choose(const Sweep& sweep, const Requirement& requirement,
                      const std::function<Result<Check>(const Setting&)>& check_setting);

/// Returns "mean position error below 5 mm" or "vision and localisation below 20 ms per frame".
std::string describe(const Requirement& requirement);
/// Returns a check in one line: the setting, its results on fresh episodes, the limit, and whether it is confirmed.
std::string describe(const Sweep& sweep, const Validation& validation);
/// Returns choice.json: the requirement, the checks, the number of candidates, the choice and its reason. The units are
/// metres and seconds, as the keys state.
std::string choice_json(const Sweep& sweep, const Requirement& requirement, const Choice& choice);
/// Returns the first lines of the robot file of a choice. @param choice with a confirmed setting
std::vector<std::string> choice_header(const Sweep& sweep, const Requirement& requirement, const Choice& choice);

}  // namespace twocone::tradeoff
