// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace twocone::report {

/// Returns the colour of a verdict, the same in every figure and table.
std::string verdict_colour(std::string_view verdict);

/// Returns the meaning of a verdict of that method in plain words; empty for an unknown verdict.
std::string_view verdict_meaning(std::string_view verdict, std::string_view method);

}  // namespace twocone::report
