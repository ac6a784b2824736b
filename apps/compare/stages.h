// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/both_runs.h"
#include "apps/compare/comparison.h"
#include "apps/compare/residuals.h"

namespace twocone::compare {

/// A quantity that can be held against a limit.
struct LimitKind {
  const char* key;    ///< of the option --max-KEY and of compare.json: rim-px
  double by_default;  ///< in the unit that the key names
  const char* what;   ///< for --help
};
/// In the order of the table.
const std::vector<LimitKind>& limit_kinds();
/// By LimitKind::key. Others are as by default.
using Limits = std::map<std::string, double>;

/// Green within the limit, amber within twice, red beyond. A gap whose sigma exceeds the limit cannot tell, unless it
/// is beyond the limit by kCertain of its sigmas. @param sigma of the gap; none: it is taken as exact
Light light_of(double gap, std::optional<double> sigma, double limit);
/// A gap that just keeps its limit is so far beyond it once in 370 times, by noise.
inline constexpr double kCertain = 3;

/// The table: each stage of the way from picture to pose, simulated and real, with lights. What sources say of their
/// own numbers (rims, gains, noise, sharpness) comes from there.
std::vector<Row> find_rows(const BothRuns& runs, const Residuals& of_simulated, const Residuals& of_real,
                           const std::vector<Source>& sources, const Limits& limits);

}  // namespace twocone::compare
