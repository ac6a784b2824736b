// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "apps/runs/run.h"

namespace twocone::runs {

/// Why resume() would refuse the run, as far as can be told before it is driven; empty: it would not.
/// @throws config::FileError for a folder that is no run
std::string why_not_resumed(const std::filesystem::path& folder);

/// Goes on with a simulated run that was interrupted or killed, so that its tables and images become those of an
/// unbroken one: the world is driven again from the start, which costs little, and the images that are there are looked
/// at in place of rendered ones. Every row that is there must come out again; a run whose tables say otherwise is
/// refused. No table is ever shorter than before, also when this is killed in its turn.
///
/// timing.csv and the last column of frames.csv tell what the machine did, and are not repeated.
/// @param options only `tell` and `open` count; the rest is the run's own
/// @returns as run(). @throws config::FileError: cannot be gone on with, and the reason: it is finished; its robot is
/// real, imported or in a served world; it had a time budget, so that the clock took part; another version of the
/// program made it; its robot file, map or scene has changed since, and what of it. DiskError. Errors: as run()
Result<runlog::RunInfo> resume(const std::filesystem::path& folder, const RunOptions& options, const Progress& progress,
                               const std::atomic<bool>& stop);

}  // namespace twocone::runs
