// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/map_file.h"

namespace twocone::report {

/// Returns the arena from above as "data:image/jpeg;base64,...". The image covers the map's bounds: world x to the
/// right, y up. It is saved as overhead.png in `folder`, which is made if necessary, and read from there the next time.
/// If it cannot be made, a note states why.
/// @param what_is the subject of the note and its verb, such as "Figure 7 is"
std::optional<std::string> overhead_uri(const std::filesystem::path& folder, const config::Map& map,
                                        std::string_view what_is, std::vector<std::string>& notes);

}  // namespace twocone::report
