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

/// A shard that is to be done.
struct Piece {
  std::size_t shard = 0;
  std::size_t kind =
      0;              ///< a process goes on with the kind that it did last while there is any: pictures to start once
  double weight = 1;  ///< its part in the progress of all, > 0
};

/// Does one shard and puts away what came of it. Told to stop, it ends soon, with any error.
/// @param progress told the share of the shard that is done
using DoShard = std::function<Status(std::size_t shard, const std::function<void(double)>& progress,
                                     const std::atomic<bool>& stop)>;
/// A line for a person; may be called from any thread.
using Tell = std::function<void(const std::string&)>;

struct WorkOptions {
  int jobs = 1;                                ///< processes at one time, >= 1
  std::function<void(double)> progress{};      ///< told the share of all pieces that is done
  Tell tell{};                                 ///< told what the processes tell
  std::chrono::milliseconds silence{600'000};  ///< a process that tells no progress for so long is killed, > 0
  std::chrono::milliseconds patience{30'000};  ///< likewise one that does not end so long after `stop`, > 0
};

/// Has the pieces done by child processes, so that memory is theirs to measure and a crash takes no more than one of
/// them along. The caller has no other thread: children are forked and go on in this program. A child dies with its
/// parent, however that dies.
///
/// `start` is called in each child before its first shard; what it returns is destroyed before the child ends. The
/// first piece that fails ends the others after the shard that they are at.
///
/// Errors: the first failed shard's own, with its number in front; kDisconnected: a child died or fell silent.
/// @returns how many pieces were done; fewer than all only after `stop`
Result<std::size_t> run_in_children(const std::vector<Piece>& pieces, const WorkOptions& options,
                                    const std::function<DoShard(const Tell& tell)>& start,
                                    const std::atomic<bool>& stop);

}  // namespace twocone::tradeoff
