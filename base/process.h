// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

#include "base/unique_fd.h"

namespace twocone::base {

/// A child process of this program. Every child process of the product is made here: child_process.h starts other
/// programs; the watchdog of the wheels continues in a copy of this one.
class Process {
 public:
  /// Owns no process.
  Process() = default;
  /// Forks: `body` runs in the child, which then exits with status 0. All signals are blocked there at first, so that
  /// none reaches a handler of the parent; unblock_signals() ends that. If this program has other threads, `body` may
  /// make only calls that a signal handler may make.
  /// @throws std::system_error naming the step that failed
  explicit Process(const std::function<void()>& body);
  /// Kills and reaps the process.
  ~Process();
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;

  /// 0: none, or it is reaped.
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// A descriptor that becomes readable when the process has ended.
  [[nodiscard]] int end_fd() const { return end_fd_.get(); }

  /// Sends a signal. The process is not reaped yet, so its number cannot belong to another one.
  void signal(int number) const noexcept;
  /// Waits for the end for at most `timeout` and reaps the process. Returns the status of waitpid(); none: it still
  /// runs.
  std::optional<int> wait(std::chrono::milliseconds timeout) noexcept;
  /// Kills and reaps the process, and returns the status of waitpid(); 0 if there is none.
  int kill() noexcept;

  /// Unblocks all signals in the calling thread; for a child. It is async-signal-safe.
  static void unblock_signals() noexcept;

 private:
  pid_t pid_ = 0;
  UniqueFd end_fd_;
};

/// Peak memory of a process since it started its program (wait4() would also count the memory of the program that
/// forked it); 0: not known, as after the process has ended.
std::uint64_t peak_memory_bytes(pid_t pid);

}  // namespace twocone::base
