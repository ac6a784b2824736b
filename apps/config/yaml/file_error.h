// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace twocone::config {

/// A file that cannot be used. The message has one line for each bad key: "robots/lab.yaml:7: drive.wheel_radius_m is
/// -0.05 m, must be > 0".
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace twocone::config
