// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The times and lines of another program's files.
namespace twocone::foreign {

/// Time on the recording's own clock, whatever its zero.
using Stamp = std::chrono::nanoseconds;

/// What the stamps of pictures count. kTold: each tells it by its form.
enum class StampUnit { kTold, kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

/// A stamp >= 0 of digits and at most one decimal point. Of itself a number with a decimal point counts seconds (TUM
/// RGB-D benchmark) and one of 19 digits nanoseconds since 1970 (EuRoC); a shorter whole number could be anything, so
/// `unit` must say. Digits beyond the nanosecond are cut off.
/// @returns nothing where the text is none, or does not tell its unit
std::optional<Stamp> parse_stamp(std::string_view text, StampUnit unit);
/// What parse_stamp() wants, for messages.
std::string stamp_forms(StampUnit unit);

/// Seconds as any decimal number, also negative or with an exponent; nothing if it is none or too large.
std::optional<Stamp> parse_seconds(const std::string& text);
double to_seconds(Stamp stamp);

/// A line that says something: neither empty nor a comment (#).
struct Line {
  std::size_t number = 0;  ///< from 1
  std::string text;        ///< without blanks at its ends
  bool whole = true;       ///< false: no newline ends it, so it may have been cut off
};
/// @throws files::FileError
std::vector<Line> read_lines(const std::filesystem::path& file);

}  // namespace twocone::foreign
