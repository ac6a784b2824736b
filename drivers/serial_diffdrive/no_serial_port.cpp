// SPDX-License-Identifier: Apache-2.0
// Replaces serial_port.cpp in a build without libserialport.
#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "drivers/serial_diffdrive/transport.h"

namespace twocone::serial {

std::string_view why_not() { return "it was built without libserialport (Debian: libserialport-dev)"; }

std::vector<DeviceInfo> list_ports() { return {}; }

Result<Connection> open_port(const std::string& /*path*/, int /*baud*/) {
  return Error{ErrorCode::kUnavailable, std::string(why_not())};
}

}  // namespace twocone::serial
