// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <vector>

#include "drivers/sim_povray/render/started_child.h"

namespace twocone::sim_povray {

/// A private folder, in memory where there is such a place, that is gone when this object or the program is, also after
/// kill -9: a small shell (the janitor) waits for the end of a pipe that only this program holds, and removes it.
class ScratchFolder {
 public:
  /// In the first of `roots` where a folder can be made and written to.
  /// @throws std::system_error if there is none, or the janitor cannot be started
  explicit ScratchFolder(const std::vector<std::filesystem::path>& roots);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void start_janitor();

  std::filesystem::path path_;
  UniqueFd alive_;  ///< its closing tells the janitor
  pid_t janitor_ = -1;
};

/// XDG_RUNTIME_DIR if there is one, /dev/shm, /tmp.
std::vector<std::filesystem::path> scratch_roots();

}  // namespace twocone::sim_povray
