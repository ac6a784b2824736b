// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace YAML {
class Node;
}

namespace twocone::config {

/// A value that replaces one key of a robot file for one run: `--set cameras.lower.width_px=320`.
struct KeyChange {
  std::string key;    ///< with its sections: cameras.lower.width_px
  std::string value;  ///< YAML, as it would stand in the file

  friend bool operator==(const KeyChange&, const KeyChange&) = default;
};

/// Returns the change that is written as KEY=VALUE. An old name of the key is replaced by the present one,
/// except within `cameras:`.
/// @throws FileError for any other text and for a value that is not YAML
KeyChange parse_change(std::string_view text);

/// Returns the change as KEY=VALUE.
std::string to_string(const KeyChange& change);

/// Returns a copy of the mapping with the changes applied in order. Sections that do not exist are added. An alias
/// keeps its value where only the other use of its anchor changes.
/// @throws FileError if a section of a key has a value that is not a mapping
YAML::Node with_changes(const YAML::Node& robot, const std::vector<KeyChange>& changes);

}  // namespace twocone::config
