// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "drivers/serial_diffdrive/protocol.h"

/// The ASCII protocol of ros_arduino_bridge (hbrobotics, joshnewans): a letter, arguments and CR; each is answered by
/// one line.
namespace twocone::serial {

/// The two counts in a reply to `e`, such as "855 -820"; nothing for any other text.
std::optional<RawCounts> parse_counts(std::string_view line);

std::unique_ptr<Protocol> make_ros_arduino_bridge();

}  // namespace twocone::serial
