// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "drivers/sim_povray/seat.h"
#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// Cameras, drive and truth of a seat that was taken with `settings`: the same whether its world is here or elsewhere.
std::unique_ptr<Simulation> make_simulation(std::unique_ptr<Seat> seat, const SeatSettings& settings);

}  // namespace twocone::sim_povray
