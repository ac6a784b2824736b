// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace twocone::base {

/// An exception whose message is one text, or a text and its values as fmt::format takes them.
template <typename Exception>
struct Formatted : Exception {
  using Exception::Exception;
  template <typename Value, typename... Values>
  Formatted(fmt::format_string<Value, Values...> text, Value&& value, Values&&... values)
      : Exception(fmt::format(text, std::forward<Value>(value), std::forward<Values>(values)...)) {}
};

/// Reports a wrong argument: a bug of the caller, or a setting outside its domain.
using InvalidArgument = Formatted<std::invalid_argument>;

/// Reports what is wrong outside the program, for example in a file.
using FormattedError = Formatted<std::runtime_error>;

}  // namespace twocone::base
