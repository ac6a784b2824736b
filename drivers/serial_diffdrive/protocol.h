// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/serial_diffdrive/transport.h"
#include "hal/result.h"

namespace twocone::serial {

template <typename Number>
struct BothWheels {
  Number left = 0;
  Number right = 0;
};
/// Encoder counts per second of each wheel; positive drives forward.
using CountRates = BothWheels<double>;
/// The controller's counters as it reports them: the low 16 or 32 bits of the counts since it was switched on.
using RawCounts = BothWheels<std::uint32_t>;
/// Whole counts of both wheels since the beginning.
using WheelCounts = BothWheels<std::int64_t>;

/// Makes counts that do not wrap from a controller's counts, which wrap at 16 or 32 bits. The result is correct as long
/// as the counts change by less than half of their range between two readings.
class WheelCounter {
 public:
  /// @param bits 16 or 32
  explicit WheelCounter(int bits) : bits_(bits) {}

  /// Returns the counts of both wheels since the last reading, if the controller was not reset in between; zero for the
  /// first reading after rebase().
  [[nodiscard]] WheelCounts step_to(const RawCounts& raw) const {
    if (!last_) return {};
    return {difference(raw.left, last_->left), difference(raw.right, last_->right)};
  }
  /// Adds a reading to the total.
  void advance(const RawCounts& raw) {
    const WheelCounts step = step_to(raw);
    total_.left += step.left;
    total_.right += step.right;
    last_ = raw;
  }
  /// Makes the next reading equal to the last total. Call it after a reset, or for another controller.
  void rebase() { last_.reset(); }

  [[nodiscard]] const WheelCounts& total() const { return total_; }

 private:
  [[nodiscard]] std::int64_t difference(std::uint32_t to, std::uint32_t from) const {
    const std::uint32_t apart = to - from;
    return bits_ == 16 ? std::int64_t(std::int16_t(std::uint16_t(apart))) : std::int64_t(std::int32_t(apart));
  }

  int bits_;
  std::optional<RawCounts> last_;
  WheelCounts total_;
};

/// The protocol of one kind of motor controller. Its calls are exchanges of tens of milliseconds. Each call tries again
/// by itself if that is safe, and leaves the transport clean for the next one.
class Protocol {
 public:
  virtual ~Protocol() = default;

  /// Returns the baud rate that is used if the robot file names none.
  [[nodiscard]] virtual int usual_baud() const = 0;
  /// Returns the width of the counters, which wrap: 16 or 32.
  [[nodiscard]] virtual int counter_bits() const = 0;
  /// Returns the counts per turn of a wheel if the controller's model fixes them; if not, the robot file gives them.
  [[nodiscard]] virtual std::optional<double> fixed_counts_per_turn() const { return std::nullopt; }

  /// Performs the handshake with a controller whose port was just opened, or which was just reset: waits for it, sets
  /// its own time-out if it has one and checks it. Returns its kind and version for a person.
  /// Errors: kTimeout, kDisconnected, kBadData, kRefused.
  virtual Result<std::string> greet(Transport& transport, Deadline deadline) = 0;
  /// Returns whether the controller confirms each command.
  [[nodiscard]] virtual bool answers_commands() const { return true; }
  /// Commands both wheels. Errors: kTimeout, kDisconnected, kBadData, kRefused (with the controller's reason).
  virtual Status drive(Transport& transport, const CountRates& rates) = 0;
  /// Reads both counters. Errors: kTimeout, kDisconnected, kBadData.
  virtual Result<RawCounts> read_counts(Transport& transport) = 0;

  /// Returns the bytes that stop the wheels after any bytes sent before, even after a part of a packet. The watchdog
  /// uses nothing else of the protocol.
  [[nodiscard]] virtual std::vector<std::uint8_t> stop_bytes() const = 0;
  /// Reports that stop_bytes() were written `times` times outside of this class. The controller answers those too, so
  /// the next exchange first finds out where its own answers begin.
  virtual void note_stops(std::uint32_t times) = 0;

  /// Returns the counts per second below which no command turns a wheel, because the controller's unit is that coarse.
  [[nodiscard]] virtual double least_command() const { return 0; }
  /// Returns the least counts per second at which its control loop turns a wheel with its default gains; 0: not known.
  [[nodiscard]] virtual double usual_least_rate() const { return 0; }
  /// Returns the time without a command after which the controller itself stops the wheels, valid after greet(); none:
  /// it never does.
  [[nodiscard]] virtual std::optional<std::chrono::milliseconds> own_timeout() const = 0;
};

struct ProtocolSettings {
  std::string name;             ///< one of kProtocolNames
  std::uint8_t address = 0x80;  ///< roboclaw: 0x80 to 0x87
  /// roboclaw: its own time-out is set to this, rounded down to a multiple of 0.1 s, but at least 0.1 s.
  std::chrono::nanoseconds command_timeout{500'000'000};
};

inline constexpr std::array<std::string_view, 3> kProtocolNames{"ros_arduino_bridge", "roboclaw", "create2"};
/// @throws std::invalid_argument for another name, or a value outside its range
std::unique_ptr<Protocol> make_protocol(const ProtocolSettings& settings);

}  // namespace twocone::serial
