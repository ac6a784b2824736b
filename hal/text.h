// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace twocone {

/// Text from outside, such as a device's name, as it may be shown in a terminal: well-formed UTF-8 without control
/// characters and without marks that turn the direction of writing; each byte of anything else becomes '?'. To be
/// called where such text enters the program.
std::string printable(std::string_view text);

}  // namespace twocone
