// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/unique_fd.h"

namespace twocone::base {

/// The limits on what a child may do with files. A POV-Ray scene from another author is a program: it can open any file
/// for reading and for writing. POV-Ray 3.7 reads its own `[Permitted Paths]` but does not enforce them
/// (github.com/POV-Ray/povray/issues/158). The kernel enforces these limits instead, for the whole process and from
/// before its first instruction.
///
///  - With Landlock (Linux 5.13, where it is enabled), the child reads only below the listed folders, and writes only
///    below one folder. It also opens no TCP connection (Linux 6.7).
///  - Otherwise, with seccomp, the child opens no file for writing and changes no folder. Its reading is not confined.
class Confinement {
 public:
  enum class Kind {
    kLandlock,
    kNoWriting,  ///< seccomp
    kNone,       ///< neither: there is no filter for this processor
  };

  /// @param readable files, and folders with everything below them; paths that do not exist are ignored
  /// @param landlock false: behaves as on a kernel without Landlock
  Confinement(std::vector<std::string> readable, bool landlock);

  [[nodiscard]] Kind kind() const { return kind_; }

  /// Makes the ruleset for enter() of kind Landlock, which allows writing below `writable` (a folder; empty: nowhere).
  /// The descriptor is invalid for every other kind.
  /// @throws std::system_error
  [[nodiscard]] UniqueFd ruleset(const std::string& writable) const;

  /// Confines the calling process permanently. It is async-signal-safe, for use between fork and exec. On failure it
  /// returns false and sets errno; the process must not continue then.
  /// @param ruleset as ruleset() returned it; -1 for a kind that has none
  [[nodiscard]] static bool enter(Kind kind, int ruleset);

 private:
  std::vector<std::string> readable_;
  Kind kind_;
};

/// Returns the version of the kernel's Landlock interface; 0: Landlock is missing or not enabled.
int landlock_version();

}  // namespace twocone::base
