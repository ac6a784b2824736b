// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace twocone::v4l2 {

/// The system calls of the driver, so that a test can emulate the kernel. They return -1 and set errno as their manual
/// pages describe.
class Kernel {
 public:
  virtual ~Kernel() = default;
  virtual int open(const char* path) = 0;  ///< for reading and writing, non-blocking
  virtual int close(int file) = 0;
  virtual int ioctl(int file, unsigned long request, void* argument) = 0;  ///< repeats a call that a signal interrupts
  virtual void* mmap(int file, std::size_t length, long offset) = 0;
  virtual int munmap(void* memory, std::size_t length) = 0;
  virtual int poll(pollfd& entry, int timeout_ms) = 0;

  /// Replaces a mapping by a private copy: same address and same bytes, but no memory of the device. On failure (-1 and
  /// errno) the mapping is unchanged.
  virtual int detach(void* memory, std::size_t length) = 0;
  /// Full paths of the entries of a folder; none if the folder does not exist.
  virtual std::vector<std::string> entries(const std::string& folder) = 0;
  /// The final target of a link; `path` itself if it is not a link.
  virtual std::string target(const std::string& path) = 0;
};

/// The real kernel.
std::shared_ptr<Kernel> real_kernel();

}  // namespace twocone::v4l2
