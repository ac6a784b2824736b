// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/serial_diffdrive/watchdog.h"
#include "hal/result.h"

namespace twocone::serial {

/// The watchdog as a small process that holds the open port: WatchdogSteps are run in it. It learns by a shared page
/// when the wheels must be at rest, is woken through a pipe, and takes the pipe's end for the program's.
///
/// It is a copy of this program (fork without exec) of a session of its own, so that neither a terminal's Ctrl-C nor a
/// signal to this program's group reaches it; it ignores what may be ignored, and ends with the pipe. It runs before
/// ordinary processes where the system lets it (root, or RLIMIT_RTPRIO). It cannot act when it is killed or halted too,
/// or when the port is gone: then only the controller's own time-out is left.
class Guard final : public Watchdog {
 public:
  /// @param port the open port, non-blocking writes; kept open by the guard as long as it lives
  /// @param stop_bytes what stops the wheels whatever was sent before
  /// @param timeout since the last expect_motion(), > 0
  /// Waits until the guard is at its post. Errors: kUnavailable (no process, memory or pipe to be had).
  static Result<std::unique_ptr<Watchdog>> post(int port, std::vector<std::uint8_t> stop_bytes,
                                                std::chrono::nanoseconds timeout);
  /// Sends it away, which stops the wheels once more, and waits until the process is gone; it is killed if that takes
  /// longer than half a second.
  ~Guard() override;

 private:
  struct Page;
  Guard(Page* page, pid_t process, int pipe, std::chrono::nanoseconds timeout);

  Status wake() override;
  void do_end(std::chrono::milliseconds patience) noexcept override;
  [[nodiscard]] std::int64_t now_ns() const override;
  void nap() override;
  [[nodiscard]] std::string name() const override;

  Page* const page_;
  pid_t process_;  // <= 0: it has ended
  const int pipe_;
};

}  // namespace twocone::serial
