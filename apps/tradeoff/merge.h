// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/shard.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns the figures of each setting from the frames of all shards, with 95 % intervals; frontiers are marked. The
/// caller fills the header fields of the result. A setting without rows has no figures, and its times are 0.
/// @throws std::invalid_argument for a row of a setting that is not in the plan, for a negative episode, and for
/// numbers that statistics.h rejects
Sweep merge(const Plan& plan, const ShardRecord& all);

/// Returns a setting's errors and times from the frames of all shards. @throws as merge
Check check_of(const Plan& plan, const ShardRecord& all, std::size_t setting);

}  // namespace twocone::tradeoff
