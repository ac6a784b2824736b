// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Reads the lines and times of another program's files, and pairs images by their times.
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

/// Returns the median time between neighbours, or nothing for fewer than two times. @param times increasing
std::optional<Stamp> median_period(const std::vector<Stamp>& times);

/// A stereo frame: indices into the two cameras' images.
struct Pair {
  std::size_t lower = 0, upper = 0;
  friend bool operator==(const Pair&, const Pair&) = default;
};

/// Pairs the images of two cameras. The two images that are nearest in time form the first pair, then the nearest of
/// those that remain, and so on within `max_skew`. Each image is in one pair at most, and the pairs have the same order
/// in both cameras.
/// @param lower,upper increasing
/// @param max_skew >= 0, at most a period
std::vector<Pair> pair_images(const std::vector<Stamp>& lower, const std::vector<Stamp>& upper, Stamp max_skew);

/// Returns, for each of `used`, the number of exposures since the previous one that are in no frame. `used` has
/// increasing indices into `times`. The number counts the images between them. Where stamps are k periods apart,
/// rounded to the nearest whole number, it also counts k - 1 exposures that were never stored. For the first, it counts
/// the images before it.
std::vector<std::uint64_t> lost_before(const std::vector<Stamp>& times, const std::vector<std::size_t>& used);

}  // namespace twocone::importer
