// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// "position error below 5 mm", "vision and localisation below 20 ms a frame".
std::string describe(const Wish& wish);
/// A trial in one line: the setting, what fresh poses gave, the limit that counts, and whether it holds.
std::string describe(const Sweep& sweep, const Trial& trial);
/// choice.json: the wish, the trials, how many settings were known not to hold, the choice and why. Metres and seconds,
/// as the keys say.
std::string choice_json(const Sweep& sweep, const Wish& wish, const Choice& choice);
/// What a chosen robot file says of itself in its first lines. @param choice of which one holds
std::vector<std::string> choice_header(const Sweep& sweep, const Wish& wish, const Choice& choice);

}  // namespace twocone::tradeoff
