// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace twocone::v4l2 {

/// What the driver asks of the system, so that a test can be the kernel. Calls of the kernel's as in their manual
/// pages: -1 and errno.
class Kernel {
 public:
  virtual ~Kernel() = default;
  virtual int open(const char* path) = 0;  ///< reads, writes, does not block
  virtual int close(int file) = 0;
  virtual int ioctl(int file, unsigned long request, void* argument) = 0;  ///< again when a signal interrupts it
  virtual void* mmap(int file, std::size_t length, long offset) = 0;
  virtual int munmap(void* memory, std::size_t length) = 0;
  virtual int poll(pollfd& entry, int timeout_ms) = 0;

  /// Puts a copy of the program's own in the place of a mapping: same address, same bytes, nothing of the device's held
  /// any more. -1 and errno: it is as it was.
  virtual int detach(void* memory, std::size_t length) = 0;
  /// Full paths of what is in a folder; none if it is not there.
  virtual std::vector<std::string> entries(const std::string& folder) = 0;
  /// Where a link leads in the end; `path` itself if it is none.
  virtual std::string target(const std::string& path) = 0;
};

/// The kernel itself.
std::shared_ptr<Kernel> real_kernel();

}  // namespace twocone::v4l2
