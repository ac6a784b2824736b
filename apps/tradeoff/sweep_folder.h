// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/shard.h"

namespace twocone::tradeoff {

/// A sweep on disk:
///
///     plan.yaml            settings, robot, map and version: enough to reject the shards of another sweep
///     shards/NNNN/         a finished shard: frames.csv ranges.csv renders.csv memory.csv render_memory.csv
///     errors.csv           a function of robot, map, options, seed and program: the same bytes however it was run
///     tradeoff.csv         the same with times and frontiers
///     tradeoff.txt         the table and the conclusions
///     index.html figures/*.svg
///
/// A shard's folder is written under another name and then renamed, so it is complete or absent. Several programs, also
/// on several machines, may write shards of one sweep at the same time.
class SweepFolder {
 public:
  /// Creates the folder, or continues one with the same plan. @throws config::FileError if it contains another sweep's
  /// plan (names the difference), or cannot be written
  SweepFolder(std::filesystem::path folder, const config::Robot& robot, const config::Map& map, const Plan& plan);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  [[nodiscard]] bool has(std::size_t shard) const;
  /// Returns the shards of the plan that do not exist yet.
  [[nodiscard]] std::vector<std::size_t> missing() const;
  void add(std::size_t shard, const ShardRecord& record) const;
  /// Returns all shards in the plan's order. @throws config::FileError naming missing shards, and lines that are not
  /// rows
  [[nodiscard]] ShardRecord read_all() const;

 private:
  std::filesystem::path folder_;
  std::size_t shards_;
};

}  // namespace twocone::tradeoff
