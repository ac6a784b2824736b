// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>

#include "apps/runs/disk.h"
#include "apps/runs/run_lock.h"

namespace twocone::runs {

/// A run folder that is being made, locked: unless it is kept, it goes again, but for what was there before.
class NewFolder {
 public:
  /// With folders lower/ and upper/. A folder that holds a run is refused, so that no run is lost to another; what a
  /// start without a frame has left is not in the way.
  /// @param old kKeep: the folder of a run that was cut off, which is only locked. @throws DiskError
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

}  // namespace twocone::runs
