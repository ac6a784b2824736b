// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/serve.h"
#include "drivers/sim_povray/server/server.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::sim_povray {

Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop) {
  auto host = SimulationHost::open(place);
  if (!host) return host.error();
  report((*host)->rendering());
  return serve(*host, name, report, stop);
}

}  // namespace twocone::sim_povray
