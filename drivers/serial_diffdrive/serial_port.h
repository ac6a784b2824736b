// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "drivers/serial_diffdrive/transport.h"
#include "hal/device_info.h"
#include "hal/result.h"

namespace twocone::serial {

/// Lists the serial ports of this machine. `what` is maker, product, serial number, as far as they are reported, and
/// the present path.
std::vector<DeviceInfo> list_ports();

/// Opens a port that only this program uses (by TIOCEXCL, and by a lock that also excludes root's other programs). If
/// it is busy, waits briefly for the watchdog of a program that just ended.
/// @param path of the port or of a link to it
/// Errors: kNotFound (no such port), kRefused (another program has it, no permission, not a serial port, no such rate),
/// kUnavailable.
Result<Connection> open_port(const std::string& path, int baud);

}  // namespace twocone::serial
