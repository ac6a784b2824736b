// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
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

inline bool is_positive(double value) { return value > 0 && std::isfinite(value); }

/// Collects complaints about the fields of a struct, or about arguments. One exception then names all of them.
class Complaints {
 public:
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    text_ += ' ' + fmt::format(format, std::forward<Args>(args)...) + ';';
  }
  template <typename... Args>
  void require(bool good, fmt::format_string<Args...> format, Args&&... args) {
    if (!good) add(format, std::forward<Args>(args)...);
  }
  /// Adds "NAME is VALUE, must be RULE" unless the value is `good`.
  void require_field(bool good, std::string_view name, double value, std::string_view rule) {
    require(good, "{} is {}, must be {}", name, value, rule);
  }
  void positive(std::string_view name, double value, std::string_view unit) {
    require(is_positive(value), "{} is {} {}, must be > 0 and finite", name, value, unit);
  }
  void not_negative(std::string_view name, double value, std::string_view unit) {
    require(value >= 0 && std::isfinite(value), "{} is {} {}, must be >= 0 and finite", name, value, unit);
  }
  void finite(std::string_view name, double value, std::string_view unit) {
    require(std::isfinite(value), "{} is {} {}, must be finite", name, value, unit);
  }
  void within(std::string_view name, int value, int least, int greatest) {
    require(value >= least && value <= greatest, "{} is {}, must be {} to {}", name, value, least, greatest);
  }
  /// @param prefix of the fields' names: "walls."
  void span(std::string_view prefix, char axis, double min_m, double max_m) {
    require(min_m < max_m && std::isfinite(max_m - min_m),
            "{0}min_{1}_m is {2} m and max_{1}_m {3} m, must be finite and min < max", prefix, axis, min_m, max_m);
  }
  void probability(std::string_view name, double value) {
    require(value >= 0 && value < 1, "{} is {}, must be >= 0 and < 1", name, value);
  }
  [[nodiscard]] bool empty() const { return text_.empty(); }
  /// Throws the complaints, if there are any. @throws std::invalid_argument, beginning with `what`
  void raise(std::string_view what) const {
    if (!text_.empty()) throw InvalidArgument("{}:{}", what, text_);
  }

 private:
  std::string text_;
};

}  // namespace twocone::base
