// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace twocone::runs {

/// Checks that `folder` may be replaced (`--force`): it is not there, or an empty folder, or a run of twocone that
/// nobody writes into and that holds nothing else. Changes nothing.
/// @throws DiskError: a link; no run; the working folder, or one that holds it; a run with files of somebody else in
/// it, the first one named; a run that another program writes
void check_replaceable(const std::filesystem::path& folder);

/// check_replaceable(), then removes the run. @throws DiskError
void remove_run(const std::filesystem::path& folder);

}  // namespace twocone::runs
