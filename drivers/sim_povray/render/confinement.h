// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "drivers/sim_povray/render/unique_fd.h"

namespace twocone::sim_povray {

/// What a child may do with files. A scene of somebody else is a program: it can open any file for reading and for
/// writing, and POV-Ray 3.7 reads its own `[Permitted Paths]` but does not enforce them
/// (github.com/POV-Ray/povray/issues/158). So the kernel does, for the whole process and from before its first
/// instruction.
///
///  - By Landlock (Linux 5.13, where it is enabled): the child reads below the folders that are listed, and writes
///  below
///    one folder. It opens no TCP connection either (Linux 6.7).
///  - Otherwise by seccomp: the child opens no file for writing and changes no folder; what it reads is not confined.
class Confinement {
 public:
  enum class Kind {
    kLandlock,
    kNoWriting,  ///< seccomp
    kNone,       ///< neither: a processor for which no filter is written
  };

  /// @param readable files, and folders with all below them; what does not exist is passed over
  /// @param landlock off: as on a kernel without Landlock
  Confinement(std::vector<std::string> readable, bool landlock);

  [[nodiscard]] Kind kind() const { return kind_; }

  /// For enter(): a Landlock ruleset that allows writing below `writable` (a folder; empty: nowhere), or nothing.
  /// @throws std::system_error
  [[nodiscard]] UniqueFd ruleset(const std::string& writable) const;

  /// Confines the calling process for good. Async-signal-safe, for use between fork and exec. False, and errno, if that
  /// failed: then the process must not go on.
  /// @param ruleset as ruleset() returned it; -1 for a kind that has none
  [[nodiscard]] static bool enter(Kind kind, int ruleset);

 private:
  std::vector<std::string> readable_;
  Kind kind_;
};

/// Version of the kernel's Landlock interface; 0: there is none, or it is not enabled.
int landlock_version();

}  // namespace twocone::sim_povray
