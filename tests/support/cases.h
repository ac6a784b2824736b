// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdlib>

namespace twocone::testing_support {

/// Returns the number of random cases of a test, at least 1: the variable TWOCONE_CASES, or else `usual`, which takes
/// seconds. evidence.sh sets the variable for the whole test.
inline int cases(int usual) {
  const char* const asked = std::getenv("TWOCONE_CASES");
  return asked != nullptr ? std::max(1, std::atoi(asked)) : usual;
}

}  // namespace twocone::testing_support
