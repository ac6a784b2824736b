// SPDX-License-Identifier: Apache-2.0
#include "localisation/fix.h"

#include <cassert>

namespace twocone::localisation {

std::string_view to_string(FixVerdict verdict) {
  switch (verdict) {
    case FixVerdict::kOk:
      return "ok";
    case FixVerdict::kGap:
      return "gap";
    case FixVerdict::kAmbiguous:
      return "ambiguous";
    case FixVerdict::kTooFew:
      return "too_few";
    case FixVerdict::kWeak:
      return "weak";
    case FixVerdict::kContradictory:
      return "contradictory";
    case FixVerdict::kOutOfBounds:
      return "out_of_bounds";
  }
  assert(false);
  return "";
}

bool is_place(const Fix& fix) {
  const bool is_given = fix.verdict == FixVerdict::kOk || fix.verdict == FixVerdict::kGap;
  return is_given && fix.position_m && !fix.other_position_m;
}

}  // namespace twocone::localisation
