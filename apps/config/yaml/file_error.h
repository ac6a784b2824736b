// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace twocone::config {

/// An error whose message is one text, or a text and its values as fmt::format takes them.
class FormattedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  template <typename Value, typename... Values>
  FormattedError(fmt::format_string<Value, Values...> text, Value&& value, Values&&... values)
      : std::runtime_error(fmt::format(text, std::forward<Value>(value), std::forward<Values>(values)...)) {}
};

/// A file that cannot be used. The message has one line for each bad key: "robots/lab.yaml:7: drive.wheel_radius_m is
/// -0.05 m, must be > 0".
class FileError : public FormattedError {
 public:
  using FormattedError::FormattedError;
};

}  // namespace twocone::config
