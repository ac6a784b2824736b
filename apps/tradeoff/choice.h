// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"
#include "hal/result.h"

namespace twocone::tradeoff {

/// What a setting is wanted for; exactly one of the two.
struct Wish {
  std::optional<double> target_m;  ///< the cheapest (robot_time_s()) whose mean position error is below this
  std::optional<double> budget_s;  ///< the most accurate whose robot_time_s() is below this
};

/// Errors and times of a setting on poses that the sweep did not use.
struct Check {
  ByLeg position_errors_m;
  ByLeg robot_times_s;
  double answered_share = 0;  ///< 0 to 1
};

/// A setting that was checked.
struct Trial {
  std::size_t setting = 0;   ///< index in Sweep::settings
  int legs = 0;              ///< fresh ones with an answer
  Interval mean_m;           ///< on the fresh poses, 95 %; infinite without an answer
  double upper_limit_m = 0;  ///< one-sided, 1 - 0.05 / number of settings swept; likewise
  Interval robot_time_s;     ///< 95 % quantile and its 95 % interval on the fresh poses; infinite without times
  double answered_share = 0;
  bool holds = false;
};

struct Choice {
  std::optional<std::size_t> setting;  ///< index in Sweep::settings; none holds
  std::vector<Trial> trials;           ///< in order, the last one is the choice if there is one
  std::string why;                     ///< a sentence for a person
};

/// Settings worth trying, in order. For a target: whose mean lies below it, cheapest first; for a budget: whose
/// robot_time_s() lies below it, most accurate first; of equal ones the better in the other first. Only those a robot
/// can have: Effects::kScene, answered often enough. Every other setting cannot hold: its mean or its time lies beyond
/// the wish already.
/// @throws std::invalid_argument for a wish that is not exactly one of the two, or is not positive and finite
std::vector<std::size_t> candidates(const Sweep& sweep, const Wish& wish);

/// Tries candidates until one holds: the upper 95 % confidence limit of its mean position error on fresh poses is below
/// the target, the level divided by the number of settings swept (Bonferroni); of a budget: the upper limit of its 95 %
/// time quantile is below the budget. It must answer often enough (kLeastAnswered) there, too. So each cheaper (more
/// accurate) setting is known not to hold.
/// @param check poses of its own for a setting; its errors end the search
Result<Choice> choose(const Sweep& sweep, const Wish& wish, const std::function<Result<Check>(const Setting&)>& check);

}  // namespace twocone::tradeoff
