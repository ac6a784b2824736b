// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace twocone {

/// Makes text from outside, such as a device's name, safe for a terminal: well-formed UTF-8 without control characters
/// and without marks that change the direction of writing. Each byte of anything else becomes '?'. Call this where such
/// text enters the program.
std::string printable(std::string_view text);

}  // namespace twocone
