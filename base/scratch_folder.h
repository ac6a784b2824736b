// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/child_process.h"

namespace twocone::base {

/// A private folder, in memory if possible, that is removed when this object or the program ends, also after kill -9.
/// For that, a small shell process (the janitor) waits for the end of a pipe that only this program holds, and then
/// removes the folder.
class ScratchFolder {
 public:
  /// Makes the folder in the first of `roots` where a folder can be made and written to.
  /// @throws std::system_error if there is none, or if the janitor cannot be started
  explicit ScratchFolder(const std::vector<std::filesystem::path>& roots);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  UniqueFd alive_;  ///< the janitor waits until this is closed
  std::optional<StartedChild> janitor_;
};

/// Returns the folders to try, in this order: XDG_RUNTIME_DIR if it is set, /dev/shm, /tmp.
std::vector<std::filesystem::path> scratch_roots();

}  // namespace twocone::base
