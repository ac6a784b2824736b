// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace twocone {

/// A device of this machine that a robot file can name.
struct DeviceInfo {
  std::string driver{};  ///< filled in by drivers::list_devices()
  std::string name{};    ///< for the robot file: if possible, a name that remains the same when it is plugged in again
  std::string what{};    ///< maker, model, present place
  std::vector<std::string> details{};  ///< formats and sizes of a camera
};

}  // namespace twocone
