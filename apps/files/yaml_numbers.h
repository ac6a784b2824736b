// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <yaml-cpp/yaml.h>

/// Numbers as files are written with. Private to this folder.
namespace twocone::files {

/// The shortest text that reads back as this very number.
std::string text_of(double number);
/// `[1, 2.5]`
YAML::Node list_of(std::span<const double> numbers);

}  // namespace twocone::files
