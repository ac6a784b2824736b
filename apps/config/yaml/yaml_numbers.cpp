// SPDX-License-Identifier: Apache-2.0
#include "apps/config/yaml/yaml_numbers.h"

#include <fmt/format.h>

namespace twocone::config {

std::string text_of(double number) { return fmt::format("{}", number); }

YAML::Node list_of(std::span<const double> numbers) {
  YAML::Node list(YAML::NodeType::Sequence);
  list.SetStyle(YAML::EmitterStyle::Flow);
  for (const double number : numbers) list.push_back(text_of(number));
  return list;
}

}  // namespace twocone::config
