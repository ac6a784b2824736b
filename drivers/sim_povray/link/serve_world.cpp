// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/hall.h"
#include "drivers/sim_povray/link/server.h"
#include "drivers/sim_povray/serve.h"

namespace twocone::sim_povray {

Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& tell, const std::atomic<bool>& stop) {
  auto hall = Hall::open(place);
  if (!hall) return hall.error();
  tell((*hall)->rendering());
  return serve(*hall, name, tell, stop);
}

}  // namespace twocone::sim_povray
