// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace twocone::cli {

/// Makes SIGINT, SIGTERM and, unless it was ignored before (nohup), SIGHUP set the returned flag, so that the work can
/// end in good order. A second signal ends the program at once.
const std::atomic<bool>& stop_on_signals();

/// Returns the signal that arrived; 0: none yet.
int stop_signal();

}  // namespace twocone::cli
