// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns "mean position error below 5 mm" or "vision and localisation below 20 ms per frame".
std::string describe(const Requirement& requirement);
/// Returns a check in one line: the setting, its results on fresh episodes, the limit, and whether it is confirmed.
std::string describe(const Sweep& sweep, const Validation& validation);
/// Returns choice.json: the requirement, the checks, the number of candidates, the choice and its reason. Metres and
/// seconds, as the keys state.
std::string choice_json(const Sweep& sweep, const Requirement& requirement, const Choice& choice);
/// Returns the first lines of the robot file of a choice. @param choice with a confirmed setting
std::vector<std::string> choice_header(const Sweep& sweep, const Requirement& requirement, const Choice& choice);

}  // namespace twocone::tradeoff
