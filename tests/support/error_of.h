// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace twocone::testing_support {

/// Returns the message of the `Exception` that `call` throws, or "no error". Other exceptions are passed on.
template <typename Exception>
std::string error_of(const auto& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace twocone::testing_support
