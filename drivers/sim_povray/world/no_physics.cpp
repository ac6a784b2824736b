// SPDX-License-Identifier: Apache-2.0
// Replaces physics.cpp in a build without the Open Dynamics Engine.
#include "drivers/sim_povray/world/physics.h"

namespace twocone::sim_povray {

Result<std::unique_ptr<PhysicsEngine>> PhysicsEngine::open() {
  return Error{ErrorCode::kUnavailable, "physics needs the Open Dynamics Engine, which this build does not have"};
}

int PhysicsEngine::opened() { return 0; }

}  // namespace twocone::sim_povray
