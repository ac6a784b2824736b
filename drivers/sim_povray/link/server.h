// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "drivers/sim_povray/hall.h"

namespace twocone::sim_povray {

/// Where a world's socket is: `NAME.sock` in `twocone/` in the user's runtime folder (XDG_RUNTIME_DIR, else
/// /run/user/UID, else /tmp/twocone-UID). The folder is made with mode 0700 and must be the user's own.
/// Errors: kRefused (no good name: letters, digits, - and _, at most 64; or a folder that is somebody else's).
Result<std::filesystem::path> world_socket(const std::string& name);

/// How long the other robots of a world wait for one that asks for nothing (its program is stopped, or hangs) before it
/// is sent away. Half of what a run waits for its world, so that the others' runs go on.
constexpr std::chrono::milliseconds kIdlePatience{30'000};

/// Shares `hall` out under `name` until `stop` is set: one seat per connection, one thread per seat.
/// @param tell one line for a person when the world can be reached, and whenever a robot comes or goes
/// Errors: kRefused (the name is served already; the folder), kUnavailable (no socket to be had).
Status serve(const std::shared_ptr<Hall>& hall, const std::string& name,
             const std::function<void(const std::string&)>& tell, const std::atomic<bool>& stop,
             std::chrono::milliseconds patience = kIdlePatience);

}  // namespace twocone::sim_povray
