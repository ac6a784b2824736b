// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial_diffdrive/transport.h"
#include "drivers/serial_diffdrive/watchdog.h"
#include "hal/diff_drive.h"
#include "hal/result.h"

/// Motor controllers on a serial port.
namespace twocone::serial {

/// Returns why this build has no serial ports: it was made without libserialport, and opening returns kUnavailable.
/// Empty: the build has the driver.
std::string_view why_not();

struct SerialDriveSettings {
  std::string port;                       ///< /dev/serial/by-id/..., /dev/ttyUSB0
  std::string protocol;                   ///< ros_arduino_bridge, roboclaw or create2
  std::optional<int> baud;                ///< none: the protocol's usual rate
  std::optional<double> counts_per_turn;  ///< encoder counts per turn of a wheel, > 0; create2 has its own
  int address = 0x80;                     ///< roboclaw: 0x80 to 0x87
  bool swap_wheels = false;               ///< the controller's first motor is the right wheel's
  bool reverse_left = false;              ///< this wheel drives forward when the controller counts backward
  bool reverse_right = false;
  /// Whether a watchdog process stops the wheels if this program cannot. Only roboclaw, whose own time-out can be set,
  /// may have none.
  bool watchdog = true;
  /// The least speed at which the controller turns a wheel, >= 0, as twocone doctor measures it; none: the protocol's
  /// usual one. The speed is never less than the smallest command of the protocol.
  std::optional<double> least_speed_radps{};

  friend bool operator==(const SerialDriveSettings&, const SerialDriveSettings&) = default;
};

/// @throws std::invalid_argument naming every bad field
void check(const SerialDriveSettings& settings);

/// Returns the least speed at which a wheel turns with these settings; slower commands are refused.
/// @param settings must be valid by check()
double least_speed_radps(const SerialDriveSettings& settings);

/// The services of the machine that a drive needs.
struct Machine {
  /// Opens a transport, at the start and whenever the last one was lost; empty: opens the serial port.
  std::function<Result<Connection>()> connect{};
  /// Starts a watchdog on Connection::descriptor.
  std::function<Result<std::unique_ptr<Watchdog>>(int descriptor, std::vector<std::uint8_t> stop_bytes,
                                                  std::chrono::nanoseconds timeout)>
      post = start_watchdog_process;
  std::function<Deadline()> now = std::chrono::steady_clock::now;
};

/// Opens a drive over a serial port: opens the port, finds the controller, sets its time-out and starts the watchdog.
/// `WheelAngles::time` is the middle of the exchange (steady clock); the controller's own delay is not known.
///
/// If the port is lost, each call tries to open it again by its path, at most four times a second. Until it is open and
/// the handshake is repeated, calls return kDisconnected at once. Angles then continue from their last values. They
/// also do so after a reset of the board, which one call reports as kDisconnected. The motion of the wheels meanwhile
/// is not known.
///
/// If a command that moves fails, a stop is sent, because the command may have been carried out. The error states that,
/// unless it is kDisconnected. If the watchdog is gone or halted, a call stops the wheels and returns kUnavailable; the
/// next call uses another watchdog. set_speeds() also returns kRefused for speeds that are not 0 and both below
/// least_speed_radps(): the wheels would not turn, and are stopped.
///
/// Errors: kNotFound, kRefused, kUnavailable, kTimeout (no answer: wrong protocol or rate, or no power), kBadData,
/// kDisconnected. @throws std::invalid_argument as check() does, and for a drive without a watchdog whose controller's
/// own time-out is longer than the limits' command_timeout: roboclaw's is 0.1 s at least.
Result<std::unique_ptr<DiffDrive>> open_drive(const SerialDriveSettings& settings, const DriveLimits& limits,
                                              Machine machine = {});

}  // namespace twocone::serial
