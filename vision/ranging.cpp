// SPDX-License-Identifier: Apache-2.0
#include "vision/ranging.h"

#include <cassert>

namespace twocone::vision {

std::string_view to_string(RangeVerdict verdict) {
  switch (verdict) {
    case RangeVerdict::kOk:
      return "ok";
    case RangeVerdict::kNotSeen:
      return "not_seen";
    case RangeVerdict::kTruncated:
      return "truncated";
    case RangeVerdict::kNoMatch:
      return "no_match";
    case RangeVerdict::kBeyondLimit:
      return "beyond_limit";
    case RangeVerdict::kSameColour:
      return "same_colour";
    case RangeVerdict::kOneView:
      return "one_view";
    case RangeVerdict::kOccluded:
      return "occluded";
    case RangeVerdict::kSaturated:
      return "saturated";
    case RangeVerdict::kTwoCandidates:
      return "two_candidates";
    case RangeVerdict::kInconsistent:
      return "inconsistent";
    case RangeVerdict::kImpossible:
      return "impossible";
  }
  assert(false);
  return "";
}

}  // namespace twocone::vision
