// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace twocone::runs {

/// The right to write into a run folder: a lock (flock) on DIR/.lock, which ends with the program, however that ends.
/// Every writer holds it for as long as it writes; who only reads needs none (run_data.h).
///
/// The file stays when the lock is given up: one that were removed could be locked by two programs.
class RunLock {
 public:
  static constexpr const char* kFileName = ".lock";

  /// Takes the lock of a folder that is there, and completes an exchange of results that a killed program began
  /// (results_exchange.h). @throws DiskError: another program holds it (with its process number where that is known),
  /// or the folder cannot be written
  explicit RunLock(const std::filesystem::path& folder);
  ~RunLock();
  RunLock(RunLock&& other) noexcept;
  RunLock& operator=(RunLock&&) = delete;

  /// Nothing where another program holds the lock, or where the folder cannot be written. @throws DiskError as
  /// complete_exchanges()
  static std::optional<RunLock> try_take(const std::filesystem::path& folder);

 private:
  explicit RunLock(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
};

}  // namespace twocone::runs
