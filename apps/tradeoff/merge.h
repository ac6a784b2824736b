// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/tradeoff/shard.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Figures of each setting from the frames of all shards, intervals of 95 %; frontiers are marked. The header fields of
/// the result are the caller's to fill. A setting without rows has no figures, and its times are 0.
/// @throws std::invalid_argument for a row of a setting that the plan has not, a negative leg, and numbers that
/// statistics.h refuses
Sweep merge(const Plan& plan, const ShardRecord& all);

/// The setting's position errors and times (vision and localisation of one frame together), leg i's in element i.
ByLeg position_errors(const ShardRecord& all, int setting);
ByLeg robot_times(const ShardRecord& all, int setting);

}  // namespace twocone::tradeoff
