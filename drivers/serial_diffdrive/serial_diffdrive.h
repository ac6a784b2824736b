// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial_diffdrive/watchdog.h"
#include "drivers/serial_diffdrive/wire.h"
#include "hal/diff_drive.h"
#include "hal/result.h"

/// Motor controllers on a serial port.
namespace twocone::serial {

/// Why this build cannot, where it was made without libserialport: opening is then kUnavailable. Empty: it can.
std::string_view why_not();

struct SerialDriveSettings {
  std::string port;                       ///< /dev/serial/by-id/..., /dev/ttyUSB0
  std::string protocol;                   ///< ros_arduino_bridge, roboclaw or create2
  std::optional<int> baud;                ///< none: the protocol's usual one
  std::optional<double> counts_per_turn;  ///< encoder counts in a turn of a wheel, > 0; create2 has its own
  int address = 0x80;                     ///< roboclaw: 0x80 to 0x87
  bool swap_wheels = false;               ///< the controller's first motor is the right wheel's
  bool reverse_left = false;              ///< this wheel drives forward where the controller counts backward
  bool reverse_right = false;
  /// Whether a guard process stops the wheels when this program cannot. Only roboclaw, whose own time-out can be set,
  /// does without.
  bool guard = true;
  /// The least speed at which the controller turns a wheel, >= 0, as twocone doctor measures it; none: the protocol's
  /// usual one. Never less than what the protocol can say.
  std::optional<double> least_speed_radps{};

  friend bool operator==(const SerialDriveSettings&, const SerialDriveSettings&) = default;
};

/// @throws std::invalid_argument naming every bad field
void check(const SerialDriveSettings& settings);

/// The least speed at which a wheel turns with these settings; slower commands are refused.
/// @param settings as check() takes them
double least_speed_radps(const SerialDriveSettings& settings);

/// An open wire, and what can post a guard at it.
struct Connection {
  std::unique_ptr<Wire> wire;
  int descriptor = -1;  ///< what the guard holds; < 0: SerialDriveSettings::guard must be false
};
using Connect = std::function<Result<Connection>()>;

/// What a drive needs of the machine that it runs on.
struct Machine {
  /// Brings a wire, at the beginning and whenever the last one went away.
  Connect connect;
  /// Posts a watchdog at Connection::descriptor; empty: a Guard.
  std::function<Result<std::unique_ptr<Watchdog>>(int descriptor, std::vector<std::uint8_t> stop_bytes,
                                                  std::chrono::nanoseconds timeout)>
      post;
  /// Empty: the steady clock.
  std::function<Deadline()> now;
};

/// A drive over a serial port. `WheelAngles::time` is the middle of the exchange (steady clock); what the controller
/// itself delays is not known.
///
/// A port that goes away is looked for again by its path, at each call and at most four times a second; until it is
/// back, and greeted again, calls answer kDisconnected at once. Angles go on from where they were, and so they do after
/// a reset of the board, which one call tells as kDisconnected. What the wheels turned meanwhile is not known.
///
/// A command that moves and fails leaves the wheels with a stop: where it may have been carried out, its error says
/// that a stop was sent after it. set_speeds() errors besides DiffDrive's: kUnavailable (the guard is gone or halted;
/// the wheels were stopped, and the next call drives with another guard). kRefused also for speeds which are not 0 and
/// both below least_speed_radps(): the wheels would not turn, and are stopped.
class SerialDiffDrive final : public DiffDrive {
 public:
  /// Opens the port, finds the controller, sets its time-out, posts the guard.
  /// Errors: kNotFound, kRefused, kUnavailable, kTimeout (no answer: wrong protocol or rate, or no power), kBadData,
  /// kDisconnected. @throws std::invalid_argument as check() does, and for a drive without a guard whose controller's
  /// own time-out is longer than the limits' command_timeout: roboclaw's is 0.1 s at least.
  static Result<std::unique_ptr<SerialDiffDrive>> open(const SerialDriveSettings& settings, const DriveLimits& limits);
  /// The same over wires that `connect` brings.
  static Result<std::unique_ptr<SerialDiffDrive>> open(const SerialDriveSettings& settings, const DriveLimits& limits,
                                                       Connect connect);
  static Result<std::unique_ptr<SerialDiffDrive>> open(const SerialDriveSettings& settings, const DriveLimits& limits,
                                                       Machine machine);
  ~SerialDiffDrive() override;

 private:
  class Impl;
  SerialDiffDrive(const DriveLimits& limits, std::unique_ptr<Impl> impl);

  Status do_set_speeds(const WheelSpeeds& speeds) override;
  Result<WheelAngles> do_read_angles() override;
  Status do_stop() noexcept override;
  [[nodiscard]] DriveFacts do_tell() const override;

  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::serial
