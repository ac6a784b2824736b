// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace twocone::runlog {

/// Checks that `folder` may be replaced (`--force`): it does not exist, or is an empty folder, or is a run of twocone
/// that no program writes and that holds nothing else. Changes nothing.
/// @throws DiskError: a link; not a run; the working folder or a parent of it; a run with files of other origin, of
/// which the first is named; a run that another program writes
void check_replaceable(const std::filesystem::path& folder);

/// Calls check_replaceable(), then removes the run. @throws DiskError
void remove_run(const std::filesystem::path& folder);

}  // namespace twocone::runlog
