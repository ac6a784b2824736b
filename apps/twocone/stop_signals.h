// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace twocone::cli {

/// From now on SIGINT, SIGTERM and, unless it was ignored before (nohup), SIGHUP set what is returned, so that the work
/// can end in good order; a second one ends the program at once.
const std::atomic<bool>& stop_on_signals();

/// The signal that came; 0: none yet.
int stop_signal();

}  // namespace twocone::cli
