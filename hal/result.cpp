// SPDX-License-Identifier: Apache-2.0
#include "hal/result.h"

#include <array>
#include <cstddef>

namespace twocone {

std::string_view to_string(ErrorCode code) {
  constexpr std::array<std::string_view, 8> kNames{"NotFound",     "Unavailable", "InvalidState", "Timeout",
                                                   "Disconnected", "BadData",     "Cancelled",    "Refused"};
  static_assert(kNames.size() == std::size_t(ErrorCode::kRefused) + 1);
  return kNames.at(std::size_t(code));
}

Error with_name(const std::string& name, const Error& error) { return {error.code, name + ": " + error.message}; }

}  // namespace twocone
