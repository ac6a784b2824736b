// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "drivers/serial_diffdrive/transport.h"
#include "hal/result.h"

namespace twocone::serial {

/// A serial port of this machine, as `twocone devices` lists it.
struct PortInfo {
  std::string path;         ///< /dev/ttyUSB0; may change when the device is plugged in again
  std::string stable_path;  ///< /dev/serial/by-id/...; empty: it has none
  std::string description;  ///< maker, product, serial number, as far as they are reported
};
std::vector<PortInfo> list_ports();

/// Opens a port that only this program uses (by TIOCEXCL, and by a lock that also excludes root's other programs). If
/// it is busy, waits briefly for the watchdog of a program that just ended.
/// @param path of the port or of a link to it
/// Errors: kNotFound (no such port), kRefused (another program has it, no permission, not a serial port, no such rate),
/// kUnavailable.
Result<Connection> open_port(const std::string& path, int baud);

}  // namespace twocone::serial
