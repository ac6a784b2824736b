// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/names.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <boost/algorithm/string.hpp>

namespace twocone::config {
namespace {

struct Renamed {
  NameOf kind;
  std::string_view old_name, name;
};
constexpr std::array kRenamed{
    Renamed{NameOf::kMethod, "full", "outline"},
    Renamed{NameOf::kRobotKey, "drive.guard", "drive.watchdog"},
    Renamed{NameOf::kRobotKey, "effects.camera.exposure_s", "effects.camera.exposure_time_s"},
    Renamed{NameOf::kRobotKey, "effects.camera.exposures", "effects.camera.shutter_samples"},
    Renamed{NameOf::kRobotKey, "cameras.*.effects.exposure_s", "cameras.*.effects.exposure_time_s"},
    Renamed{NameOf::kRobotKey, "cameras.*.effects.exposures", "cameras.*.effects.shutter_samples"},
    Renamed{NameOf::kColumn, "leg", "episode"},
    Renamed{NameOf::kColumn, "instant", "step"},
    Renamed{NameOf::kFile, "effort.csv", "timing.csv"},
    Renamed{NameOf::kOption, "--legs", "--episodes"},
    Renamed{NameOf::kOption, "--check-legs", "--validation-episodes"},
};

/// Renames the key at `path` below `node`. "*" matches each key.
void rename(YAML::Node node, std::string_view path, std::string_view name) {
  if (!node.IsDefined() || !node.IsMap()) return;
  const std::size_t dot = path.find('.');
  const std::string key(path.substr(0, dot));
  if (dot == std::string_view::npos) {
    const std::string present(name);
    if (!node[key].IsDefined() || node[present].IsDefined()) return;
    const YAML::Node value = node[key];
    node.remove(key);
    node[present] = value;
    return;
  }
  const std::string_view below = path.substr(dot + 1);
  if (key == "*") {
    for (auto entry : node) rename(entry.second, below, name);
  } else if (node[key].IsDefined()) {
    rename(node[key], below, name);
  }
}

/// Returns the Levenshtein distance: the number of letters to insert, delete or replace.
std::size_t edit_distance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < to.size(); ++j) {
      const std::size_t replaced = diagonal + (from[i] == to[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string_view present_name(NameOf kind, std::string_view name) {
  for (const Renamed& renamed : kRenamed) {
    if (renamed.kind == kind && renamed.old_name == name) return renamed.name;
  }
  return name;
}

std::optional<std::string_view> old_name(NameOf kind, std::string_view name) {
  for (const Renamed& renamed : kRenamed) {
    if (renamed.kind == kind && renamed.name == name) return renamed.old_name;
  }
  return std::nullopt;
}

std::string present_columns(std::string_view header) {
  std::vector<std::string> columns;
  boost::split(columns, header, boost::is_any_of(","));
  for (std::string& column : columns) column = std::string(present_name(NameOf::kColumn, column));
  return boost::join(columns, ",");
}

YAML::Node with_present_names(const YAML::Node& robot) {
  YAML::Node node = robot;  // refers to the same node, because a clone would lose its line numbers
  if (!node.IsDefined() || !node.IsMap()) return node;
  for (const Renamed& renamed : kRenamed) {
    if (renamed.kind != NameOf::kRobotKey) continue;
    rename(node, renamed.old_name, renamed.name.substr(renamed.name.rfind('.') + 1));
  }
  const YAML::Node method = node["estimator"].IsMap() ? node["estimator"]["method"] : YAML::Node();
  if (method.IsDefined() && method.IsScalar()) {
    node["estimator"]["method"] = std::string(present_name(NameOf::kMethod, method.Scalar()));
  }
  return node;
}

std::optional<std::string> nearest(std::string_view word, const std::vector<std::string>& known) {
  std::optional<std::string> best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    const bool near = distance * 3 <= candidate.size() || candidate.starts_with(fmt::format("{}_", word));
    if (near && distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace twocone::config
