// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Reads the times and lines of another program's files.
namespace twocone::importer {

/// Time on the recording's own clock, whatever its zero is.
using Stamp = std::chrono::nanoseconds;

/// The unit of the images' stamps. kAuto: the form of each stamp determines its unit.
enum class StampUnit { kAuto, kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

/// The units that --times-in names, with the number of decimals that are whole nanoseconds.
struct NamedUnit {
  StampUnit unit;
  const char* name;
  std::size_t decimals;
};
inline constexpr std::array kNamedUnits{
    NamedUnit{StampUnit::kSeconds, "s", 9}, NamedUnit{StampUnit::kMilliseconds, "ms", 6},
    NamedUnit{StampUnit::kMicroseconds, "us", 3}, NamedUnit{StampUnit::kNanoseconds, "ns", 0}};

/// Parses a stamp >= 0 of digits and at most one decimal point. With kAuto, a number with a decimal point is in seconds
/// (TUM RGB-D benchmark) and a number of 19 digits is in nanoseconds since 1970 (EuRoC). A shorter whole number is
/// ambiguous and needs another `unit`. Digits beyond the nanosecond are cut off.
/// @returns nothing if the text is not a stamp or its unit is ambiguous
std::optional<Stamp> parse_stamp(std::string_view text, StampUnit unit);
/// Returns the forms that parse_stamp() accepts, for messages.
std::string stamp_forms(StampUnit unit);

/// Parses seconds as any decimal number, also negative or with an exponent. Returns nothing for other or too large
/// input.
std::optional<Stamp> parse_seconds(const std::string& text);
double to_seconds(Stamp stamp);

/// A line with content: neither empty nor a comment (#).
struct Line {
  std::size_t number = 0;  ///< from 1
  std::string text;        ///< without blanks at its ends
  bool whole = true;       ///< false: the line has no newline, so it may have been cut off
};
/// @throws config::FileError
std::vector<Line> read_lines(const std::filesystem::path& file);

}  // namespace twocone::importer
