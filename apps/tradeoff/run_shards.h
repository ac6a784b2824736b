// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/sweep.h"
#include "apps/tradeoff/sweep_folder.h"
#include "apps/tradeoff/work.h"

namespace twocone::tradeoff {

/// What a sweep is of. `plan` was made of the other two.
struct Subject {
  const files::Robot& robot;
  const files::Map& map;
  const Plan& plan;
};

/// Runs shards of the plan by ShardRunner in child processes (run_in_children: errors, and what is returned) and puts
/// each into the folder once it is whole. One that is there by then is not done again.
Result<std::size_t> run_shards(const Subject& subject, const SweepFolder& folder,
                               const std::vector<std::size_t>& shards, const WorkOptions& options,
                               const std::atomic<bool>& stop);

/// Merges a complete folder and writes errors.csv, tradeoff.csv and tradeoff.txt into it.
/// @throws files::FileError as SweepFolder::read_all; runs::DiskError
Sweep finish_sweep(const Subject& subject, const SweepFolder& folder);

/// A setting's errors and times on fresh poses (make_check_plan), for choose(). Made with those of all settings of the
/// same pictures, since rendering is what costs, and kept in the sweep's folder, in checks/: none is rendered twice.
/// @param setting one of the plan's. Errors: those of run_shards; kRefused when it was stopped
Result<Check> run_check(const Subject& subject, const SweepFolder& folder, const Setting& setting, int legs,
                        const WorkOptions& options, const std::atomic<bool>& stop);

}  // namespace twocone::tradeoff
