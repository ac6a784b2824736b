// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

/// Handles old and misspelt names. One table lists the names of version 0.1. Files with old names stay readable, but
/// only present names are written. An option with an old name is rejected, and the message states the present name.
namespace twocone::config {

enum class NameOf {
  kMethod,    ///< `estimator.method`, run.yaml's `method`, a folder in methods/
  kRobotKey,  ///< a key of the robot file, with its section: "drive.guard"
  kColumn,    ///< a column of a sweep's tables
  kFile,      ///< a file of a run folder
  kOption,    ///< an option of the command line
};

/// Returns the present name for `name`, or `name` itself if it is not an old one.
std::string_view present_name(NameOf kind, std::string_view name);
/// Returns the old name of `name`, or nothing if it never had another name.
std::optional<std::string_view> old_name(NameOf kind, std::string_view name);

/// Returns the header line of a table with old column names replaced by present ones.
std::string present_columns(std::string_view header);

/// Replaces old keys and values in a robot file's node by present ones, and returns the node. An old key beside the
/// present one stays and is reported as unknown.
YAML::Node with_present_names(const YAML::Node& robot);

/// Returns the known name that `word` probably means. A third of the name's letters may be wrong (Levenshtein
/// distance), or the suffix after an underscore, such as a unit, may be missing. The first of the nearest names is
/// returned.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& known);

}  // namespace twocone::config
