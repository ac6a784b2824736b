// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace twocone::files {

/// The known name that was probably meant by `word`: a third of the name's letters may be wrong (Levenshtein distance),
/// or what follows an underscore, a unit say, be missing. The first of those that are nearest.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& known);

}  // namespace twocone::files
