// SPDX-License-Identifier: Apache-2.0
#include "localisation/fix.h"

#include <array>
#include <cstddef>

namespace twocone::localisation {

std::string_view to_string(FixVerdict verdict) {
  constexpr std::array<std::string_view, 7> kNames{"ok",   "gap",           "ambiguous",    "too_few",
                                                   "weak", "contradictory", "out_of_bounds"};
  return kNames.at(std::size_t(verdict));
}

bool is_place(const Fix& fix) {
  const bool is_given = fix.verdict == FixVerdict::kOk || fix.verdict == FixVerdict::kGap;
  return is_given && fix.position_m && !fix.other_position_m;
}

}  // namespace twocone::localisation
