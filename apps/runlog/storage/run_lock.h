// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "base/unique_fd.h"

namespace twocone::runlog {

/// The right to write into a run folder: a lock (flock) on DIR/.lock, which ends with the program in every case. Every
/// writer holds it while it writes. Readers need no lock (run_data.h).
///
/// The file remains when the lock is released. If it were removed, two programs could lock it.
class RunLock {
 public:
  static constexpr const char* kFileName = ".lock";

  /// Locks an existing folder, and completes an exchange of results that a killed program began (results_exchange.h).
  /// @throws DiskError: another program holds the lock (with its process number if known), or the folder cannot be
  /// written
  explicit RunLock(const std::filesystem::path& folder);
  ~RunLock();
  RunLock(RunLock&& other) noexcept = default;
  RunLock& operator=(RunLock&&) = delete;

  /// Returns nothing if another program holds the lock or the folder cannot be written.
  /// @throws DiskError as complete_exchanges()
  static std::optional<RunLock> try_take(const std::filesystem::path& folder);

 private:
  explicit RunLock(base::UniqueFd locked) : descriptor_(std::move(locked)) {}

  base::UniqueFd descriptor_;
};

}  // namespace twocone::runlog
