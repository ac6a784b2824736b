// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/compare/matching.h"
#include "apps/compare/side.h"

namespace twocone::compare {

/// A quantity that can have a limit.
struct LimitKind {
  const char* key;    ///< as in the option --max-KEY and in compare.json: rim-px
  double by_default;  ///< in the unit that the key names
  const char* what;   ///< for --help
};
/// Returns all kinds in the order of the table.
const std::vector<LimitKind>& limit_kinds();
/// Limits by LimitKind::key. A key that is missing has its default.
using Limits = std::map<std::string, double>;

/// Returns green within the limit, amber within twice the limit, red beyond. A gap whose sigma exceeds the limit gives
/// kCannotTell, unless it is beyond the limit by kCertain of its sigmas. @param sigma of the gap; none: the gap is
/// exact
Light light_of(double gap, std::optional<double> sigma, double limit);
/// Noise puts a gap that just meets its limit this far beyond it once in 370 times.
inline constexpr double kCertain = 3;

/// Returns the table: each stage from image to pose, simulated and real, with lights. Numbers of sources (rims, gains,
/// noise, sharpness) come from the sources.
std::vector<Row> find_rows(const BothRuns& runs, const Residuals& of_simulated, const Residuals& of_real,
                           const std::vector<Source>& sources, const Limits& limits);

}  // namespace twocone::compare
