// SPDX-License-Identifier: Apache-2.0
#include "vision/ranging.h"

#include <array>

namespace twocone::vision {

std::string_view to_string(RangeVerdict verdict) {
  constexpr std::array<std::string_view, 12> kNames{"ok",           "not_seen",       "truncated",    "no_match",
                                                    "beyond_limit", "same_colour",    "one_view",     "occluded",
                                                    "saturated",    "two_candidates", "inconsistent", "impossible"};
  static_assert(std::size_t(RangeVerdict::kImpossible) + 1 == kNames.size());
  return kNames.at(std::size_t(verdict));
}

}  // namespace twocone::vision
