// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <gmock/gmock.h>

#include "hal/result.h"

namespace twocone::testing_support {

/// Matches a result that is an error of this kind.
MATCHER_P(FailsWith, code, "fails with " + std::string(to_string(code))) {
  if (arg) {
    *result_listener << "which succeeded";
    return false;
  }
  *result_listener << "which failed with " << to_string(arg.error().code) << ": " << arg.error().message;
  return arg.error().code == code;
}

/// Matches a result that is an error of this kind, with this message. @param message a string, or a matcher
MATCHER_P2(FailsWith, code, message, "fails with " + std::string(to_string(code)) + " and its message") {
  return testing::ExplainMatchResult(FailsWith(code), arg, result_listener) &&
         testing::ExplainMatchResult(message, arg.error().message, result_listener);
}

}  // namespace twocone::testing_support
