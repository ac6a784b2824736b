// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"

/// Words and numbers that table, images and page share. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// The units of table, images and page in SI units.
constexpr double kMm = 1e-3, kMs = 1e-3, kMiB = 1 << 20, kDegree = std::numbers::pi / 180;

/// Figures that do not exist, for std::optional::value_or. They are written like any number that is not finite.
inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
inline constexpr Interval kNoInterval{kNoNumber, kNoNumber, kNoNumber};
inline constexpr ErrorFigures kNoErrors{kNoInterval, kNoInterval, kNoInterval, kNoNumber};

/// Returns "+R2"; "-" for one ray per pixel.
std::string antialias_name(int antialias);

/// Formats with `digits` significant digits, without an exponent for any value of this program; "-" for a value that is
/// not finite.
std::string significant(double value, int digits = 3);
/// Formats like significant(), with fewer digits where the text would exceed `width` columns.
std::string fitting(double value, std::size_t width);

/// The values that most settings of a sweep have, so that a short name can omit them.
struct Usual {
  int landmarks = 0;
  double rate_hz = 0;
};
Usual usual_of(const Sweep& sweep);
/// Returns "320x240 +R2 fine x4": images, estimator, frames, and the values that differ from the usual ones.
std::string short_name(const Setting& setting, const Usual& usual);

/// Returns the index of method paper with the robot file's own images; if they were not swept, with its own size; else
/// of the most accurate one. None where method paper never answered.
std::optional<std::size_t> baseline_of(const Sweep& sweep);

/// The number of settings on the frontier of simulation time, and their range.
struct Span {
  int settings = 0;
  double least_error_m = 0, most_error_m = 0;
  double least_time_s = 0, most_time_s = 0;
};
/// Returns nothing without a frontier.
std::optional<Span> span_of(const Sweep& sweep);

/// Returns the rule of a frontier, the precision of the truth, and the meaning of the intervals: a sentence each.
std::vector<std::string> rule_sentences();
/// Returns a line for each growth: "rendering time by size: exponent 1.02 (0.97 to 1.07), 5 points".
std::vector<std::string> growth_sentences(const Sweep& sweep);

}  // namespace twocone::tradeoff
