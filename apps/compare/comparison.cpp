// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/comparison.h"

#include <algorithm>
#include <cassert>

namespace twocone::compare {

std::string_view to_string(Light light) {
  switch (light) {
    case Light::kNone:
      return "none";
    case Light::kGreen:
      return "green";
    case Light::kAmber:
      return "amber";
    case Light::kRed:
      return "red";
    case Light::kCannotTell:
      return "cannot tell";
  }
  assert(false);
  return "";
}

std::string_view to_string(SourceVerdict verdict) {
  switch (verdict) {
    case SourceVerdict::kDiffers:
      return "differs";
    case SourceVerdict::kAgrees:
      return "agrees";
    case SourceVerdict::kCannotTell:
      return "cannot tell";
  }
  assert(false);
  return "";
}

}  // namespace twocone::compare
