// SPDX-License-Identifier: Apache-2.0
#include "apps/config/key_change.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"

namespace twocone::config {
namespace {

/// Returns the mapping with a new value at `path`, which is the rest of the change's key.
YAML::Node with_value(const YAML::Node& mapping, std::string_view path, const KeyChange& change) {
  if (mapping.IsDefined() && !mapping.IsMap() && !mapping.IsNull()) {
    const std::string_view section = std::string_view(change.key).substr(0, change.key.size() - path.size() - 1);
    throw FileError("--set {}: {} is not a section of the robot file", to_string(change), section);
  }
  const std::size_t dot = path.find('.');
  const std::string key(path.substr(0, dot));
  const auto value_for = [&](const YAML::Node& old) {
    return dot == std::string_view::npos ? parse_yaml(change.value, "--set " + to_string(change))
                                         : with_value(old, path.substr(dot + 1), change);
  };
  // Nodes are shared, so that an assignment would also change an alias of this mapping.
  YAML::Node changed(YAML::NodeType::Map);
  bool is_there = false;
  for (const auto& pair : mapping) {
    const bool is_meant = pair.first.IsScalar() && pair.first.Scalar() == key;
    is_there = is_there || is_meant;
    changed.force_insert(pair.first, is_meant ? value_for(pair.second) : pair.second);
  }
  if (!is_there) changed.force_insert(key, value_for(YAML::Node(YAML::NodeType::Null)));
  return changed;
}

}  // namespace

KeyChange parse_change(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view key = text.substr(0, equals);
  const bool has_gap = key.starts_with('.') || key.ends_with('.') || key.find("..") != std::string_view::npos;
  if (equals == std::string_view::npos || equals + 1 == text.size() || !is_name(key, "._") || has_gap) {
    throw FileError("--set {}: must be KEY=VALUE, such as cameras.lower.antialias=3", text);
  }
  KeyChange change{std::string(present_name(NameOf::kRobotKey, key)), std::string(text.substr(equals + 1))};
  (void)parse_yaml(change.value, fmt::format("--set {}", text));
  return change;
}

std::string to_string(const KeyChange& change) { return fmt::format("{}={}", change.key, change.value); }

YAML::Node with_changes(const YAML::Node& robot, const std::vector<KeyChange>& changes) {
  YAML::Node changed = robot;
  for (const KeyChange& change : changes) changed.reset(with_value(changed, change.key, change));
  return changed;
}

}  // namespace twocone::config
