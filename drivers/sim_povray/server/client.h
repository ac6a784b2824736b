// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Joins the world that another program serves under `name` (server/server.h).
/// Errors: kNotFound (no program serves it), kRefused (another version, another user, and the errors of
/// SimulationHost::join), kTimeout, kDisconnected. @throws std::invalid_argument as check(SessionSettings)
Result<std::unique_ptr<RobotSession>> join_served_world(const std::string& name, const SessionSettings& settings,
                                                        std::chrono::milliseconds timeout);

}  // namespace twocone::sim_povray
