// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <type_traits>
#include <utility>

#include "hal/result.h"

namespace twocone::testing_support {

/// Returns the value of a result, if it has one. @throws std::runtime_error with the message of an error
template <typename T>
T value(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

}  // namespace twocone::testing_support
