// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// Makes the cameras, drive and truth of a session that joined with `settings`. They are the same whether its world is
/// in this program or in another one.
std::unique_ptr<Simulation> make_simulation(std::unique_ptr<RobotSession> session, const SessionSettings& settings);

}  // namespace twocone::sim_povray
