// SPDX-License-Identifier: Apache-2.0
// This file replaces physics_test.cpp in a build without the Open Dynamics Engine.
#include <gtest/gtest.h>

#include "drivers/sim_povray/world/physics.h"
#include "drivers/sim_povray/world/world.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using testing_support::FailsWith;

// Catches a robot that silently moves without the physics that its settings require.
TEST(Physics, ARobotThatNeedsTheMissingEngineIsRefused) {
  World world{PlaceSettings{}};
  RobotBody body{.radius_m = 0.2};
  EXPECT_TRUE(world.add_robot(body));
  body.start.x_m = 1;
  body.physics = Physics{};
  EXPECT_THAT(
      world.add_robot(body),
      FailsWith(ErrorCode::kUnavailable, "physics needs the Open Dynamics Engine, which this build does not have"));
  EXPECT_EQ(PhysicsEngine::opened(), 0);
}

}  // namespace
}  // namespace twocone::sim_povray
