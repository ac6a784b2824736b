// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>

#include "drivers/sim_povray/simulation_host.h"

namespace twocone::sim_povray::server {

/// Talks with one client from its handshake to its end: when it leaves or is sent away, or `stop` is set.
/// @param report called from this thread @param stop checked twenty times a second
/// @param patience how long others wait for a client that requests nothing, before it is sent away
void converse(int socket, SimulationHost& host, const std::function<void(const std::string&)>& report,
              const std::atomic<bool>& stop, std::chrono::milliseconds patience);

}  // namespace twocone::sim_povray::server
