// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "drivers/serial_diffdrive/protocol.h"

/// The ASCII protocol of ros_arduino_bridge (hbrobotics, joshnewans): a letter, arguments and CR; a line for each.
namespace twocone::serial {

/// The two counts of a reply to `e`: "855 -820". Nothing for anything else.
std::optional<RawCounts> parse_counts(std::string_view line);

std::unique_ptr<Protocol> make_ros_arduino_bridge();

}  // namespace twocone::serial
