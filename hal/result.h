// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace twocone {

/// Kinds of failure. There is one kind for each different way in which a caller can react.
enum class ErrorCode {
  kNotFound,      ///< no such device, file or driver: check the name
  kUnavailable,   ///< known, but not in this build or not on this machine: install it or plug it in
  kInvalidState,  ///< the call is not allowed in the object's present state
  kTimeout,       ///< nothing arrived before the deadline: it is safe to try again
  kDisconnected,  ///< the device or its program is gone: open it again
  kBadData,       ///< bytes arrived, but they are not a frame or reply
  kCancelled,     ///< the caller requested the end (a signal): work done so far remains valid
  kRefused,       ///< the device or its program refused the request; the message holds the reason
};

/// Returns the code's name without its `k`, for messages and tables: "Timeout".
inline std::string_view to_string(ErrorCode code) {
  constexpr std::array<std::string_view, 8> kNames{"NotFound",     "Unavailable", "InvalidState", "Timeout",
                                                   "Disconnected", "BadData",     "Cancelled",    "Refused"};
  static_assert(kNames.size() == std::size_t(ErrorCode::kRefused) + 1);
  return kNames.at(std::size_t(code));
}

/// A code to branch on and one sentence for a person.
struct Error {
  Error(ErrorCode kind, std::string text) : code(kind), message(std::move(text)) {}
  /// Formats the message from its text and values, in the way of fmt.
  template <typename Value, typename... Values>
  Error(ErrorCode kind, fmt::format_string<Value, Values...> text, Value&& value, Values&&... values)
      : code(kind), message(fmt::format(text, std::forward<Value>(value), std::forward<Values>(values)...)) {}

  ErrorCode code;
  std::string message;
};

/// Returns the error with the name of a device or part before its message: "upper: the cable is out".
inline Error with_name(const std::string& name, const Error& error) {
  return {error.code, name + ": " + error.message};
}

/// A value, or the reason why there is none. The spelling follows std::expected (C++23).
template <typename T>
class [[nodiscard]] Result {
 public:
  // Both are implicit on purpose, for `return value;` and `return Error{...};`.
  Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return content_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  /// Returns the value. A call on a result without a value is a bug of the caller.
  [[nodiscard]] const T& value() const& { return assert(has_value()), std::get<0>(content_); }
  [[nodiscard]] T& value() & { return assert(has_value()), std::get<0>(content_); }
  [[nodiscard]] T&& value() && { return assert(has_value()), std::move(std::get<0>(content_)); }
  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }

  [[nodiscard]] const Error& error() const { return assert(!has_value()), std::get<1>(content_); }

 private:
  std::variant<T, Error> content_;
};

/// Success, or the reason why not.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return !error_; }
  explicit operator bool() const { return has_value(); }
  [[nodiscard]] const Error& error() const { return assert(!has_value()), *error_; }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace twocone
