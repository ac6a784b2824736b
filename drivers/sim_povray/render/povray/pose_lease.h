// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/child_process.h"

namespace twocone::sim_povray {

/// A file in memory that a child cannot open until it has been written. It holds POV-Ray until its pose is there.
///
/// It uses the kernel's leases (fcntl(2), F_SETLEASE). The holder of a write lease is notified (SIGIO) when a process
/// opens the file, and that open() blocks in the kernel until the lease is given back, at most
/// /proc/sys/fs/lease-break-time seconds; then it is broken by force. A dead holder's lease is gone.
class PoseLease {
 public:
  /// Starts without a lease: the file can be opened. @throws std::system_error if this machine has no memory file
  explicit PoseLease(const std::string& text);

  /// Descriptor that the child must be given, to open it as /proc/self/fd/N.
  [[nodiscard]] int fd() const { return fd_.get(); }
  /// Whether a process waits to open the file (or was let in by force).
  [[nodiscard]] bool wanted() const;
  /// Writes `text` and gives the lease back. @throws std::system_error
  void give(const std::string& text);
  /// Takes the lease; returns false while a process still has the file open. The signal goes to the calling *thread*,
  /// which must have it blocked: unhandled, it kills the program. @throws std::system_error if no lease is available
  [[nodiscard]] bool take();

 private:
  void write(const std::string& text);
  base::UniqueFd fd_;
};

/// Returns why this machine gives no leases that last long enough; empty if it does.
std::string lease_obstacle();
/// Returns how long this machine honours a lease. 0: unknown.
int lease_break_time_s();

}  // namespace twocone::sim_povray
