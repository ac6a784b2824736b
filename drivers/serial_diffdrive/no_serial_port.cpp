// SPDX-License-Identifier: Apache-2.0
// Replaces serial_port.cpp in a build without libserialport.
#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "drivers/serial_diffdrive/serial_port.h"

namespace twocone::serial {

std::string_view why_not() { return "it was built without libserialport (Debian: libserialport-dev)"; }

std::vector<PortInfo> list_ports() { return {}; }

Result<std::unique_ptr<SerialPort>> SerialPort::open(const std::string& /*path*/, int /*baud*/) {
  return Error{ErrorCode::kUnavailable, std::string(why_not())};
}
SerialPort::~SerialPort() = default;
Status SerialPort::write(std::span<const std::uint8_t> /*bytes*/, Deadline /*deadline*/) {
  return Error{ErrorCode::kUnavailable, std::string(why_not())};
}
Result<std::size_t> SerialPort::read(std::span<std::uint8_t> /*room*/, Deadline /*deadline*/) {
  return Error{ErrorCode::kUnavailable, std::string(why_not())};
}
Status SerialPort::discard_input() { return Error{ErrorCode::kUnavailable, std::string(why_not())}; }

}  // namespace twocone::serial
