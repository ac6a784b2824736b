// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <yaml-cpp/yaml.h>

/// Writes numbers as YAML. Private to this folder.
namespace twocone::config {

/// Returns the shortest text that reads back as the same number.
std::string text_of(double number);
/// Returns a list in flow style: `[1, 2.5]`.
YAML::Node list_of(std::span<const double> numbers);

}  // namespace twocone::config
