// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>

#include "drivers/sim_povray/render/child_process.h"
#include "hal/result.h"

namespace twocone::sim_povray::link {

/// The right to serve at a socket's path: a lock on `NAME.lock` beside it, which the kernel drops with the program,
/// however it ends. So whoever has the lock may take away a dead server's socket. Both files go with the claim.
class ServedName {
 public:
  /// Errors: kRefused (it is served already), kUnavailable (no file is to be had there).
  static Result<ServedName> claim(const std::filesystem::path& socket);

  ServedName(ServedName&&) noexcept = default;
  ServedName& operator=(ServedName&&) = delete;
  ~ServedName();

 private:
  ServedName(std::filesystem::path socket, UniqueFd lock) : socket_(std::move(socket)), lock_(std::move(lock)) {}

  std::filesystem::path socket_;
  UniqueFd lock_;
};

/// Takes away what a server that was killed left there; nothing if one is alive.
/// @param patience how long to try while the lock is held: of a program that is killed, the kernel closes connections
/// some time before it drops locks
void sweep(const std::filesystem::path& socket, std::chrono::milliseconds patience) noexcept;

}  // namespace twocone::sim_povray::link
