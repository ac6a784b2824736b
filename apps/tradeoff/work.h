// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "hal/result.h"

namespace twocone::tradeoff {

/// A unit of work: one shard.
struct Piece {
  std::size_t shard = 0;
  std::size_t kind = 0;  ///< a process prefers the kind of its last shard, so that the renderer is started once
  double weight = 1;     ///< its share of the total progress, > 0
};

/// Runs one shard and stores its results. It ends soon after `stop` is set, with any error.
/// @param progress called with the fraction of the shard that is done
using DoShard = std::function<Status(std::size_t shard, const std::function<void(double)>& progress,
                                     const std::atomic<bool>& stop)>;
/// Receives a line for the user; may be called from any thread.
using Notify = std::function<void(const std::string&)>;

struct WorkOptions {
  int jobs = 1;                                ///< processes at the same time, >= 1
  std::function<void(double)> progress{};      ///< called with the fraction of all pieces that is done
  Notify tell{};                               ///< called with the lines that the processes send
  std::chrono::milliseconds silence{600'000};  ///< a process without a sign of progress for this time is killed, > 0
  std::chrono::milliseconds patience{30'000};  ///< a process that has not ended this long after `stop` is killed, > 0
};

/// Runs the pieces in child processes, so that their memory can be measured and a crash ends only one of them. The
/// caller must have no other thread, because children are forked and continue in this program. A child dies with its
/// parent, however the parent dies.
///
/// `start` is called in each child before its first shard; its return value is destroyed before the child ends. After
/// the first piece that fails, the other children end when their present shard is finished.
///
/// Errors: the first failed shard's own, with its number in front; kDisconnected: a child died or was silent for too
/// long.
/// @returns the number of finished pieces; less than all only after `stop`
Result<std::size_t> run_in_children(const std::vector<Piece>& pieces, const WorkOptions& options,
                                    const std::function<DoShard(const Notify& notify)>& start,
                                    const std::atomic<bool>& stop);

}  // namespace twocone::tradeoff
