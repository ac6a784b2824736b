// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

/// Writes numbers as YAML. Private to this folder.
namespace twocone::config {

/// Returns the shortest text that reads back as the same number.
inline std::string text_of(double number) { return fmt::format("{}", number); }
/// Returns a list in flow style: `[1, 2.5]`.
inline YAML::Node list_of(std::span<const double> numbers) {
  YAML::Node list(YAML::NodeType::Sequence);
  list.SetStyle(YAML::EmitterStyle::Flow);
  for (const double number : numbers) list.push_back(text_of(number));
  return list;
}

}  // namespace twocone::config
