// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/shard.h"

namespace twocone::tradeoff {

/// A sweep on disk:
///
///     plan.yaml            what is swept, of which robot and map, by which version: enough to refuse another sweep's
///     shards/NNNN/         of a finished shard: frames.csv ranges.csv renders.csv memory.csv
///     errors.csv           a function of robot, map, options, seed and program: the same bytes however it was run
///     tradeoff.csv         that with the times, and what lies on the frontiers
///     tradeoff.txt         the table and the conclusions
///     index.html figures/*.svg
///
/// A shard's folder is written under another name and renamed, so it is whole or not there. Several programs, also on
/// several machines, may write shards of one sweep at a time.
class SweepFolder {
 public:
  /// Makes the folder, or goes on with one of the same plan. @throws files::FileError: it holds another sweep's plan
  /// (names what differs), or cannot be written
  SweepFolder(std::filesystem::path folder, const files::Robot& robot, const files::Map& map, const Plan& plan);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  [[nodiscard]] bool has(std::size_t shard) const;
  /// Those of the plan that are not there yet.
  [[nodiscard]] std::vector<std::size_t> missing() const;
  void add(std::size_t shard, const ShardRecord& record) const;
  /// Of all shards in the plan's order. @throws files::FileError naming shards that are missing, and lines that are no
  /// rows
  [[nodiscard]] ShardRecord read_all() const;

 private:
  std::filesystem::path folder_;
  std::size_t shards_;
};

}  // namespace twocone::tradeoff
