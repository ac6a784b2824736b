// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/tradeoff/shard.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns the figures of each setting from the frames of all shards, with 95 % intervals; frontiers are marked. The
/// caller fills the header fields of the result. A setting without rows has no figures, and its times are 0.
/// @throws std::invalid_argument for a row of a setting that is not in the plan, for a negative episode, and for
/// numbers that statistics.h rejects
Sweep merge(const Plan& plan, const ShardRecord& all);

/// Return the setting's position errors and times (vision and localisation of one frame together); element i is episode
/// i.
ByEpisode position_errors(const ShardRecord& all, int setting);
ByEpisode robot_times(const ShardRecord& all, int setting);

}  // namespace twocone::tradeoff
