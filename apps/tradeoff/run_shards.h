// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/shard.h"
#include "apps/tradeoff/sweep.h"
#include "hal/result.h"

namespace twocone::tradeoff {

/// The robot, the map, and the plan that was made from them.
struct Subject {
  const config::Robot& robot;
  const config::Map& map;
  const Plan& plan;
};

/// Functions that receive the progress and the messages of a run of shards.
struct Watch {
  std::function<void(double)> progress;            ///< called with the fraction of all shards that is done
  std::function<void(const std::string&)> report;  ///< called from any thread with a line for the user
};

/// Runs shards of the plan one after the other and adds each to the folder when it is complete. A shard that another
/// program has added in the meantime is not run again.
/// @returns the number of finished shards; it is less than all only if `stop` was set
/// Errors: those of RunShard, with the shard's number in front. @throws runlog::DiskError
Result<std::size_t> run_shards(const Subject& subject, const SweepFolder& folder,
                               const std::vector<std::size_t>& shards, const Watch& watch,
                               const std::atomic<bool>& stop);

/// Returns the figures of each setting from the frames of all shards, with 95 % intervals and marked frontiers. The
/// caller fills the header fields of the result. A setting without rows has no figures, and its times are 0.
/// @throws std::invalid_argument for a row of a setting that is not in the plan, for a negative episode, and for
/// numbers that statistics.h rejects
Sweep merge(const Plan& plan, const ShardRecord& all);

/// Returns a setting's errors and times from the frames of all shards. @throws as merge
Check check_of(const Plan& plan, const ShardRecord& all, std::size_t setting);

/// Merges a complete folder and writes errors.csv, tradeoff.csv, tradeoff.json and tradeoff.txt into it.
/// @throws config::FileError as SweepFolder::read_all; runlog::DiskError
Sweep finish_sweep(const Subject& subject, const SweepFolder& folder);

/// Returns a setting's errors and times on fresh episodes (make_check_plan), for choose(). All settings of the same
/// images are measured together, because rendering takes most of the time. The results are stored in the sweep's
/// folder, in checks/, and nothing is rendered twice.
/// @param setting one of the plan's settings
/// Errors: those of run_shards; kCancelled if `stop` was set
Result<Check> run_check(const Subject& subject, const SweepFolder& folder, const Setting& setting, int episodes,
                        const Watch& watch, const std::atomic<bool>& stop);

}  // namespace twocone::tradeoff
