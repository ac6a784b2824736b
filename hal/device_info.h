// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace twocone {

/// A device of this machine that a robot file can name.
struct DeviceInfo {
  std::string driver{};  ///< filled in by drivers::list_devices()
  std::string name{};    ///< for the robot file: if possible, a name that remains the same when it is plugged in again
  std::string what{};    ///< maker, model, present place
  std::vector<std::string> details{};  ///< formats and sizes of a camera
};

/// Makes text from outside, such as a device's name, safe for a terminal: well-formed UTF-8 without control characters
/// and without marks that change the direction of writing. Each byte of anything else becomes '?'. Call this where such
/// text enters the program.
std::string printable(std::string_view text);

}  // namespace twocone
