// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace twocone::config {

/// Returns the known name that `word` probably means. A third of the name's letters may be wrong (Levenshtein
/// distance), or the suffix after an underscore, such as a unit, may be missing. The first of the nearest names is
/// returned.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& known);

}  // namespace twocone::config
