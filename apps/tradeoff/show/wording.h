// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/tradeoff/sweep.h"

/// What table, pictures and page say alike. Private to apps/tradeoff.
namespace twocone::tradeoff {

/// "+R2"; "-" for one ray a pixel.
std::string antialias_name(int antialias);

/// So many significant digits, never an exponent for what these programs measure; "-" for what is not finite.
std::string significant(double value, int digits = 3);
/// significant(), with fewer digits where it would take more than `width` columns.
std::string fitting(double value, std::size_t width);
/// "0.160 (0.150 to 0.171)" in units of `unit`, e.g. 1e-3 for millimetres; the interval only where it is finite.
std::string with_interval(const Interval& interval, double unit);

/// What most settings of a sweep have, so that a short name need not say it.
struct Usual {
  int landmarks = 0;
  double rate_hz = 0;
};
Usual usual_of(const Sweep& sweep);
/// "320x240 +R2 fine x4": pictures, estimator, frames; and what differs from the usual.
std::string short_name(const Setting& setting, const Usual& usual);

/// Index of method paper with the robot file's own pictures; where they were not swept, at its own size; else of the
/// most accurate. None where method paper never answered.
std::optional<std::size_t> baseline_of(const Sweep& sweep);

/// How many settings are on the frontier of simulation time, and between what.
struct Span {
  int settings = 0;
  double least_error_m = 0, most_error_m = 0;
  double least_time_s = 0, most_time_s = 0;
};
/// None without a frontier.
std::optional<Span> span_of(const Sweep& sweep);
/// Axes on which the sweep has at least two values.
std::vector<Axis> swept_axes(const Sweep& sweep);

/// What puts a setting on a frontier, how precise the truth is, and what the intervals are of: a sentence each.
std::vector<std::string> rule_sentences();
/// "rendering time by size: exponent 1.02 (0.97 to 1.07), 5 points", a line for each.
std::vector<std::string> growth_sentences(const Sweep& sweep);

}  // namespace twocone::tradeoff
