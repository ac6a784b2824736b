// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>

#include "hal/result.h"

namespace twocone::serial {

using Deadline = std::chrono::steady_clock::time_point;

/// The bytes to and from a motor controller. One thread at a time.
class Wire {
 public:
  virtual ~Wire() = default;

  /// The time that its deadlines are of; another one than the machine's where the other end is simulated.
  [[nodiscard]] virtual Deadline now() const { return std::chrono::steady_clock::now(); }
  [[nodiscard]] Deadline in(std::chrono::milliseconds time) const { return now() + time; }

  /// Hands all of `bytes` to the port. Errors: kTimeout, kDisconnected.
  virtual Status write(std::span<const std::uint8_t> bytes, Deadline deadline) = 0;
  /// Waits for bytes and takes at most `room.size()` of them; returns how many, > 0. What has come already is taken
  /// even after the deadline. Errors: kTimeout, kDisconnected.
  virtual Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) = 0;
  /// Forgets what has come and was not read. Errors: kDisconnected.
  virtual Status discard_input() = 0;
  /// Says nothing for so long; where no time passes at the other end, it may return at once.
  virtual void pause(std::chrono::milliseconds time) { std::this_thread::sleep_for(time); }
};

}  // namespace twocone::serial
