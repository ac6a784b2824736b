// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/result.h"

namespace twocone::serial {

/// A small process that stops the wheels when this one cannot: it holds the open port, and listens at a pipe. When the
/// pipe closes (this program ended, however), or falls silent for the time-out after a command that moves (this program
/// hangs), it writes the stop bytes to the port, and in a silence that lasts, again after each time-out.
///
/// It is a copy of this program (fork without exec) of a session of its own, so that neither a terminal's Ctrl-C nor a
/// signal to this program's group reaches it; it ignores what may be ignored, and ends with the pipe. It runs before
/// ordinary processes where the system lets it (root, or RLIMIT_RTPRIO). It cannot act when it is killed or halted too,
/// or when the port is gone: then only the controller's own time-out is left.
class Guard {
 public:
  /// @param port the open port, non-blocking writes; kept open by the guard as long as it lives
  /// @param stop_bytes what stops the wheels whatever was sent before
  /// @param timeout since the last command(true), > 0
  /// Waits until the guard is at its post. Errors: kUnavailable (no process or pipe to be had).
  static Result<std::unique_ptr<Guard>> post(int port, std::vector<std::uint8_t> stop_bytes,
                                             std::chrono::nanoseconds timeout);
  /// Ends the guard, which stops the wheels once more, and waits for it.
  ~Guard();
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

  /// Says whether the wheels turn: before a command that moves, and after one that stopped them, so that in between the
  /// guard believes the worse.
  /// Errors: kUnavailable (the guard is gone, or does not listen any more: the wheels must not turn).
  Status command(bool moves) noexcept;

  [[nodiscard]] pid_t process() const { return process_; }

 private:
  Guard(pid_t process, int pipe) : process_(process), pipe_(pipe) {}

  const pid_t process_;
  const int pipe_;
};

}  // namespace twocone::serial
