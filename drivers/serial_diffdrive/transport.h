// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>

#include "hal/result.h"

namespace twocone::serial {

using Deadline = std::chrono::steady_clock::time_point;

/// The byte stream to and from a motor controller. It must be used by one thread at a time.
class Transport {
 public:
  virtual ~Transport() = default;

  /// The present time of the clock of its deadlines. It is not the machine's clock if the other end is simulated.
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

/// An open transport, and its descriptor for a watchdog.
struct Connection {
  std::unique_ptr<Transport> transport;
  int descriptor = -1;  ///< held by the watchdog; < 0: SerialDriveSettings::watchdog must be false
};

}  // namespace twocone::serial
