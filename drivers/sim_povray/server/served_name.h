// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>

#include "base/unique_fd.h"
#include "hal/result.h"

namespace twocone::sim_povray::server {

/// The right to serve at a socket's path: a lock on `NAME.lock` beside it, which the kernel releases when the program
/// ends in any way. The holder of the lock may therefore remove a dead server's socket. Both files are removed with the
/// claim.
class ServedName {
 public:
  /// Errors: kRefused (it is already served), kUnavailable (no file can be made there).
  static Result<ServedName> claim(const std::filesystem::path& socket);

  ServedName(ServedName&&) noexcept = default;
  ServedName& operator=(ServedName&&) = delete;
  ~ServedName();

 private:
  ServedName(std::filesystem::path socket, base::UniqueFd lock) : socket_(std::move(socket)), lock_(std::move(lock)) {}

  std::filesystem::path socket_;
  base::UniqueFd lock_;
};

/// Removes the files that a killed server left there; does nothing if a server is alive.
/// @param patience how long to try while the lock is held: the kernel closes the connections of a killed program some
/// time before it releases its locks
void sweep(const std::filesystem::path& socket, std::chrono::milliseconds patience) noexcept;

}  // namespace twocone::sim_povray::server
