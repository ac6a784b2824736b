// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/old_names.h"

#include <array>

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
  std::string columns;
  while (true) {
    const std::size_t comma = header.find(',');
    columns += present_name(NameOf::kColumn, header.substr(0, comma));
    if (comma == std::string_view::npos) return columns;
    columns += ',';
    header.remove_prefix(comma + 1);
  }
}

YAML::Node with_present_names(const YAML::Node& robot) {
  YAML::Node node = robot;  // the same node: a clone would lose its line numbers
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

}  // namespace twocone::config
