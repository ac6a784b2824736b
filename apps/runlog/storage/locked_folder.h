// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "apps/runlog/storage/disk.h"
#include "base/unique_fd.h"

namespace twocone::runlog {

/// A lock (flock) on DIR/.lock, which gives the right to write into a run folder. It ends with the program in every
/// case. Every writer holds it during writing. Readers need no lock (run_data.h).
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

/// Creates and locks a run folder. Unless keep() is called, the destructor removes it, except for earlier content.
class NewFolder {
 public:
  /// Creates the folders lower/ and upper/ too. Rejects a folder that holds a run, because no run may be overwritten.
  /// Remains of a start without a frame are accepted.
  /// @param old kKeep: the folder of a run that was cut off; it is only locked. @throws DiskError
  explicit NewFolder(std::filesystem::path folder, OldLines old = OldLines::kDrop);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  void keep() { is_kept_ = true; }

 private:
  void clear() const;

  std::filesystem::path folder_;
  bool was_there_;
  bool is_kept_;
  std::optional<RunLock> lock_;
  std::set<std::filesystem::path> before_;
};

/// Checks that `folder` may be replaced (`--force`): it does not exist, or is an empty folder, or is a run of twocone
/// that no program writes and that holds nothing else. Changes nothing.
/// @throws DiskError: a link; not a run; the working folder or a parent of it; a run with files of other origin, of
/// which the first is named; a run that another program writes
void check_replaceable(const std::filesystem::path& folder);

/// Calls check_replaceable(), then removes the run. @throws DiskError
void remove_run(const std::filesystem::path& folder);

}  // namespace twocone::runlog
