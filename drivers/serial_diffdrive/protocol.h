// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial_diffdrive/wire.h"
#include "hal/result.h"

namespace twocone::serial {

/// Encoder counts a second of each wheel; positive drives forward.
struct CountRates {
  double left = 0;
  double right = 0;
};

/// The controller's counters as it tells them: the low 16 or 32 bits of the counts since it was switched on.
struct RawCounts {
  std::uint32_t left = 0;
  std::uint32_t right = 0;
};

/// What one kind of motor controller says and understands. Its calls are exchanges of tens of milliseconds: each tries
/// again by itself where that is safe, and leaves the wire clean for the next.
class Protocol {
 public:
  virtual ~Protocol() = default;

  /// Rate of the line where the robot file names none.
  [[nodiscard]] virtual int usual_baud() const = 0;
  /// 16 or 32: how wide the counters are before they wrap.
  [[nodiscard]] virtual int counter_bits() const = 0;
  /// Counts in a turn of a wheel where the model fixes them; else the robot file says.
  [[nodiscard]] virtual std::optional<double> fixed_counts_per_turn() const { return std::nullopt; }

  /// Talks to a controller whose port was just opened, or which was just reset: waits for it, sets its own time-out
  /// where it has one and checks it. Returns its kind and version for a person.
  /// Errors: kTimeout, kDisconnected, kBadData, kRefused.
  virtual Result<std::string> greet(Wire& wire, Deadline deadline) = 0;
  /// Whether the controller tells that a command arrived.
  [[nodiscard]] virtual bool answers_commands() const { return true; }
  /// Errors: kTimeout, kDisconnected, kBadData, kRefused (the controller says why).
  virtual Status drive(Wire& wire, const CountRates& rates) = 0;
  /// Errors: kTimeout, kDisconnected, kBadData.
  virtual Result<RawCounts> read_counts(Wire& wire) = 0;

  /// What stops the wheels whatever was sent before it, even a part of a packet. The guard knows nothing else.
  [[nodiscard]] virtual std::vector<std::uint8_t> stop_bytes() const = 0;
  /// Somebody wrote stop_bytes() so many times: the controller answers those, too. The next exchange first finds out
  /// where its own answers begin.
  virtual void note_stops(std::uint32_t times) = 0;

  /// Counts a second below which no command makes a wheel turn, because the controller's unit is that coarse.
  [[nodiscard]] virtual double least_command() const { return 0; }
  /// Counts a second that its control loop turns a wheel at, at least, with the gains that it comes with; 0: not known.
  [[nodiscard]] virtual double usual_least_rate() const { return 0; }
  /// After so long without a command the controller itself stops the wheels, once it was greeted; none: never.
  [[nodiscard]] virtual std::optional<std::chrono::milliseconds> own_timeout() const = 0;
};

struct ProtocolSettings {
  std::string name;             ///< one of protocol_names()
  std::uint8_t address = 0x80;  ///< roboclaw: 0x80 to 0x87
  /// roboclaw: its own time-out is set to this, rounded down to 0.1 s, the least that it has.
  std::chrono::nanoseconds command_timeout{500'000'000};
};

std::vector<std::string_view> protocol_names();
/// @throws std::invalid_argument for another name, or a value outside its range
std::unique_ptr<Protocol> make_protocol(const ProtocolSettings& settings);

}  // namespace twocone::serial
