// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "drivers/sim_povray/render/started_child.h"

namespace twocone::sim_povray {

/// A file in memory at whose opening a child waits until it has been written: the door at which POV-Ray is held.
///
/// The kernel's leases (fcntl(2), F_SETLEASE) do that. Who holds a write lease is told (SIGIO) when somebody opens the
/// file, and that open() blocks in the kernel until the lease is given back, at most /proc/sys/fs/lease-break-time
/// seconds; then it is broken by force. A dead holder's lease is gone.
class PoseLease {
 public:
  /// The door stands open. @throws std::system_error if this machine has no memory file
  explicit PoseLease(const std::string& text);

  /// What the child must be given to open as /proc/self/fd/N.
  [[nodiscard]] int fd() const { return fd_.get(); }
  /// Whether somebody waits at the door (or has been let in by force).
  [[nodiscard]] bool wanted() const;
  /// Writes `text` and opens the door. @throws std::system_error
  void give(const std::string& text);
  /// Closes the door; false while whoever came in still has the file open. The signal will go to the calling *thread*,
  /// which must have it blocked: unhandled, it kills the program. @throws std::system_error if there is no lease to be
  /// had
  [[nodiscard]] bool take();

 private:
  void write(const std::string& text);
  UniqueFd fd_;
};

/// Why this machine gives no leases that last long enough; empty if it does.
std::string lease_obstacle();
/// How long a lease is honoured by this machine. 0: unknown.
int lease_break_time_s();

}  // namespace twocone::sim_povray
