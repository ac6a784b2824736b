// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/protocol.h"

#include <fmt/ranges.h>

#include "base/errors.h"
#include "drivers/serial_diffdrive/message_formats.h"

namespace twocone::serial {

std::unique_ptr<Protocol> make_protocol(const ProtocolSettings& settings) {
  if (settings.name == "ros_arduino_bridge") return make_ros_arduino_bridge();
  if (settings.name == "roboclaw") return make_roboclaw(settings.address, settings.command_timeout);
  if (settings.name == "create2") return make_create2();
  throw base::InvalidArgument("no protocol '{}'; there are: {}", settings.name, fmt::join(kProtocolNames, ", "));
}

}  // namespace twocone::serial
