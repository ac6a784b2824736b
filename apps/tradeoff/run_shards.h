// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/sweep.h"
#include "apps/tradeoff/sweep_folder.h"
#include "apps/tradeoff/work.h"

namespace twocone::tradeoff {

/// The robot, the map, and the plan that was made from them.
struct Subject {
  const config::Robot& robot;
  const config::Map& map;
  const Plan& plan;
};

/// Runs shards of the plan by ShardRunner in child processes (errors and return value: run_in_children) and adds each
/// to the folder when it is complete. A shard that another program has added meanwhile is not run again.
Result<std::size_t> run_shards(const Subject& subject, const SweepFolder& folder,
                               const std::vector<std::size_t>& shards, const WorkOptions& options,
                               const std::atomic<bool>& stop);

/// Merges a complete folder and writes errors.csv, tradeoff.csv and tradeoff.txt into it.
/// @throws config::FileError as SweepFolder::read_all; runlog::DiskError
Sweep finish_sweep(const Subject& subject, const SweepFolder& folder);

/// Returns a setting's errors and times on fresh episodes (make_check_plan), for choose(). All settings of the same
/// images are measured together, because rendering takes most of the time. The results are stored in the sweep's
/// folder, in checks/, so that nothing is rendered twice.
/// @param setting one of the plan's. Errors: those of run_shards; kCancelled if it was stopped
Result<Check> run_check(const Subject& subject, const SweepFolder& folder, const Setting& setting, int episodes,
                        const WorkOptions& options, const std::atomic<bool>& stop);

}  // namespace twocone::tradeoff
