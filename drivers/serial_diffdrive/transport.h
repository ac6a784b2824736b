// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "hal/device_info.h"
#include "hal/result.h"

namespace twocone::serial {

using Deadline = std::chrono::steady_clock::time_point;

/// The byte stream to and from a motor controller. It must be used by one thread at a time.
class Transport {
 public:
  virtual ~Transport() = default;

  /// Returns the present time of the deadlines' clock, which is not the machine's if the other end is simulated.
  [[nodiscard]] virtual Deadline now() const { return std::chrono::steady_clock::now(); }
  [[nodiscard]] Deadline in(std::chrono::milliseconds time) const { return now() + time; }

  /// Writes all of `bytes` to the port. Errors: kTimeout, kDisconnected.
  virtual Status write(std::span<const std::uint8_t> bytes, Deadline deadline) = 0;
  /// Waits for bytes and reads at most `room.size()` of them; returns their number, > 0. Bytes that have already
  /// arrived are read even after the deadline. Errors: kTimeout, kDisconnected.
  virtual Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) = 0;
  /// Discards the bytes that have arrived and were not read. Errors: kDisconnected.
  virtual Status discard_input() = 0;
  /// Sends nothing for this time. It may return at once if no time passes at the other end.
  virtual void pause(std::chrono::milliseconds time) { std::this_thread::sleep_for(time); }
};

/// A transport that keeps the first bytes received, for a message to a user who connected another device than the
/// configured one.
class MonitoredTransport final : public Transport {
 public:
  explicit MonitoredTransport(Transport& transport) : transport_(transport) {}

  [[nodiscard]] Deadline now() const override { return transport_.now(); }
  Status write(std::span<const std::uint8_t> bytes, Deadline deadline) override {
    return transport_.write(bytes, deadline);
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) override {
    auto got = transport_.read(room, deadline);
    if (got) note(room.first(*got));
    return got;
  }
  Status discard_input() override {
    std::array<std::uint8_t, 256> room;
    // The number of rounds is limited, because a device that never pauses would keep the program here.
    for (int i = 0; i < 16; ++i) {
      const auto got = transport_.read(room, transport_.now());
      if (!got) break;
      note(std::span(room).first(*got));
    }
    return transport_.discard_input();
  }
  void pause(std::chrono::milliseconds time) override { transport_.pause(time); }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const std::string& beginning() const { return beginning_; }

 private:
  static constexpr std::size_t kKept = 60;

  void note(std::span<const std::uint8_t> bytes) {
    count_ += bytes.size();
    const auto some = bytes.first(std::min(bytes.size(), kKept - beginning_.size()));
    beginning_.append(some.begin(), some.end());
  }

  Transport& transport_;
  std::size_t count_ = 0;
  std::string beginning_;
};

/// An open transport, and its descriptor for a watchdog.
struct Connection {
  std::unique_ptr<Transport> transport;
  int descriptor = -1;  ///< held by the watchdog; < 0: SerialDriveSettings::watchdog must be false
};

/// Lists the serial ports of this machine. `what` is maker, product, serial number, as far as they are reported, and
/// the present path.
std::vector<DeviceInfo> list_ports();

/// Opens a port that only this program uses (by TIOCEXCL, and by a lock that also excludes root's other programs). If
/// the port is busy, the call waits briefly for the watchdog of a program that just ended.
/// @param path of the port or of a link to it
/// Errors: kNotFound (no such port), kRefused (another program has it, no permission, not a serial port, no such rate),
/// kUnavailable.
Result<Connection> open_port(const std::string& path, int baud);

}  // namespace twocone::serial
