// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
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

/// Green within the limit, amber within twice, red beyond.
Light light_of(double gap, double limit);

/// The table: each stage of the way from picture to pose, simulated and real, with lights. What sources say of their
/// own numbers (rims, gains, noise, sharpness) comes from there.
std::vector<Row> find_rows(const BothRuns& runs, const Residuals& of_simulated, const Residuals& of_real,
                           const std::vector<Source>& sources, const Limits& limits);

}  // namespace twocone::compare
