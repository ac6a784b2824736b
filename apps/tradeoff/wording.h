// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/tradeoff/sweep.h"

/// Words and numbers that the table and the files share. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// The units of the table, expressed in SI units.
constexpr double kMm = 1e-3, kMs = 1e-3, kMiB = 1 << 20;

/// Values for missing figures, for std::optional::value_or. They are written like any number that is not finite.
inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
inline constexpr Interval kNoInterval{kNoNumber, kNoNumber, kNoNumber};
inline constexpr ErrorFigures kNoErrors{kNoInterval, kNoInterval, kNoInterval, kNoNumber};

/// Returns "+R2"; "-" for one ray per pixel.
std::string antialias_name(int antialias);

/// Formats with `digits` significant digits, without an exponent for any value of this program; "-" for a value that is
/// not finite.
std::string significant(double value, int digits = 3);
/// Formats like significant(), with fewer digits if the text would exceed `width` columns.
std::string fitting(double value, std::size_t width);

/// Returns the index of the setting of method paper with the robot file's own images; if these were not swept, with its
/// image size; otherwise of the most accurate one. Returns nothing if method paper never answered.
std::optional<std::size_t> baseline_of(const Sweep& sweep);

/// The number of settings on the frontier of simulation time, and their range.
struct Span {
  int settings = 0;
  double least_error_m = 0, most_error_m = 0;
  double least_time_s = 0, most_time_s = 0;
};
/// Returns the span of the frontier, or nothing without a frontier.
std::optional<Span> span_of(const Sweep& sweep);

/// Returns a sentence each on the rule of a frontier, the precision of the truth, and the meaning of the intervals.
std::vector<std::string> rule_sentences();
/// Returns a line for each growth: "rendering time by size: exponent 1.02 (0.97 to 1.07), 5 points".
std::vector<std::string> growth_sentences(const Sweep& sweep);

// ---- conclusions

/// Returns a sentence on the effect and the cost of each axis on which the sweep has at least two values. It uses all
/// pairs of settings that differ in nothing else:
///
///     anti-aliasing: from none to +R2 the error falls to 0.41 times (0.35 to 0.48, 12 pairs) at 1.9 times the
///     simulation time; beyond +R2 no gain in accuracy was found: from +R2 to +R3 the error is 1.02 times (0.93
///     to 1.11, 12 pairs) at 1.4 times the simulation time
///
/// A step leads to the next value of the axis, in order of size (levels: in the order of Level), among the values that
/// enough settings have. A step to adaptive precision begins at the uniform kFine, and a step to other effects at those
/// of the scene. Settings that answer less often than kLeastAnswered are left out; a value that only such settings have
/// is named.
///
/// A step's ratio of mean position errors is the geometric mean over pairs. Its 95 % interval is Student's over the
/// pairs' logarithms, or that of the pairs' own intervals, taken as independent; on each side the wider one is used.
/// (They are not independent. Within a pair the episodes are common, which makes the interval too wide; between pairs
/// they are common too, which makes it too narrow.) The cost is robot_time_s(); for size, anti-aliasing and effects it
/// is simulation_time_s().
///
/// A ratio whose interval excludes 1 is an effect: "the error falls to" or "rises to". Otherwise "no effect on the
/// error was found"; if the interval reaches beyond 0.8 to 1.25, the sentence adds that an effect is not excluded. With
/// too few episodes for an interval, the sentence states only the measured ratio.
std::map<Axis, std::string> conclusions(const Sweep& sweep);

/// Growth of error or time along an axis that has a size, as the exponent of a power law. The exponent comes from
/// weighted least squares of logarithms, within groups of settings that differ in nothing else; each group has its own
/// factor. Its 95 % interval comes from the figures' own intervals or from the scatter about the law, whichever is
/// wider. Axes: pixels of an image (error, vision, rendering), landmarks (error, vision), frames (error). Times are
/// medians, errors are means. Without a group of two sizes there is no Growth.
struct Growth {
  Axis axis{};
  std::string of;  ///< "position error", "vision time", "rendering time"
  double exponent = 0;
  double low = 0, high = 0;
  int points = 0;
};
std::vector<Growth> growth(const Sweep& sweep);

}  // namespace twocone::tradeoff
