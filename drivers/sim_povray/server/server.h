// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::sim_povray {

/// Returns the path of a world's socket: `NAME.sock` in `twocone/` in the user's runtime folder (XDG_RUNTIME_DIR, else
/// /run/user/UID, else /tmp/twocone-UID). The folder is made with mode 0700 and must be the user's own.
/// Errors: kRefused (not a valid name: letters, digits, - and _, at most 64; or the folder belongs to another user).
Result<std::filesystem::path> world_socket(const std::string& name);

/// Time for which the other robots of a world wait for one that requests nothing (its program is stopped, or hangs)
/// before it is sent away. It is half of the time that a run waits for its world, so that the others' runs continue.
constexpr std::chrono::milliseconds kIdlePatience{30'000};

/// Shares `host` under `name` until `stop` is set: one session per connection, one thread per session.
/// @param report one line for a person when the world can be reached, and whenever a robot joins or leaves
/// Errors: kRefused (the name is already served; the folder), kUnavailable (no socket is available).
Status serve(const std::shared_ptr<SimulationHost>& host, const std::string& name,
             const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop,
             std::chrono::milliseconds patience = kIdlePatience, const WorldWatch& watch = {});

/// Joins the world that another program serves under `name` (serve()).
/// Errors: kNotFound (no program serves it), kRefused (another version, another user), kTimeout, kDisconnected,
/// kUnavailable, kBadData (it is not this program), and those of SimulationHost::join.
/// @throws std::invalid_argument as check(SessionSettings)
Result<std::unique_ptr<RobotSession>> join_served_world(const std::string& name, const SessionSettings& settings,
                                                        std::chrono::milliseconds timeout);

}  // namespace twocone::sim_povray
