// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/process.h"
#include "drivers/serial_diffdrive/watchdog.h"
#include "hal/result.h"

namespace twocone::serial {

/// The watchdog as a small process that holds the open port and runs WatchdogSteps. It reads the deadline from a shared
/// page and is woken through a pipe. The end of the pipe means the end of the program.
///
/// The process is a copy of this program (fork without exec) in its own session, so that neither a terminal's Ctrl-C
/// nor a signal to this program's group reaches it. It ignores all signals that may be ignored, and ends with the pipe.
/// It runs before ordinary processes if the system allows it (root, or RLIMIT_RTPRIO). It cannot act if it is killed or
/// halted too, or if the port is gone: then only the controller's own time-out remains.
class WatchdogProcess final : public Watchdog {
 public:
  /// Starts a watchdog and waits until it is ready. Errors: kUnavailable (no process, memory or pipe is available).
  /// @param port the open port, with non-blocking writes; the watchdog keeps it open as long as it runs
  /// @param stop_bytes the bytes that stop the wheels after any bytes sent before
  /// @param timeout time since the last expect_motion(), > 0
  static Result<std::unique_ptr<Watchdog>> post(int port, std::vector<std::uint8_t> stop_bytes,
                                                std::chrono::nanoseconds timeout);
  /// Ends the watchdog, which stops the wheels once more, and waits until its process is gone. The process is killed if
  /// that takes longer than half a second.
  ~WatchdogProcess() override;

 private:
  /// Unmaps the shared page.
  struct Unmap {
    void operator()(WatchdogState* state) const;
  };
  using SharedState = std::unique_ptr<WatchdogState, Unmap>;
  WatchdogProcess(SharedState state, base::Process process, base::UniqueFd pipe, std::chrono::nanoseconds timeout);

  Status wake() override;
  void do_end(std::chrono::milliseconds patience) noexcept override;
  [[nodiscard]] std::int64_t now_ns() const override;
  void nap() override;
  [[nodiscard]] std::string name() const override;

  const SharedState state_;
  base::Process process_;
  const base::UniqueFd pipe_;
};

}  // namespace twocone::serial
