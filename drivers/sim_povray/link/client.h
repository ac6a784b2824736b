// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "drivers/sim_povray/seat.h"

namespace twocone::sim_povray {

/// A seat in the world that another program serves under `name` (link/server.h).
/// Errors: kNotFound (nobody serves it), kRefused (another version, another user, and what Hall::take_seat says),
/// kTimeout, kDisconnected. @throws std::invalid_argument as check(SeatSettings)
Result<std::unique_ptr<Seat>> take_remote_seat(const std::string& name, const SeatSettings& settings,
                                               std::chrono::milliseconds timeout);

}  // namespace twocone::sim_povray
