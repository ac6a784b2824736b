// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"
#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Robots with mass, on the floor's plane, by the Open Dynamics Engine. Entered only by a world that has such a robot.
///
/// A robot is a uniform disc, I = m R^2 / 2, with the wheels at y = +-separation / 2. Each wheel carries m g / 2,
/// always: no load goes from wheel to wheel as the robot speeds up or turns. At each wheel's contact point friction
/// drives the speed along the wheel to that of its rim and the speed across to zero, with at most mu m g / 2 in
/// whatever direction: Coulomb's circle. The two wheels' impulses over a step are those after which the points slide
/// least (the convex problem of greatest dissipation, with the velocity at the step's end): stable whatever the step's
/// length, exact at both ends of it, gripping and sliding. They are found before, and so without, the forces of
/// contacts; for a robot pressed against something that means that a rim speed below mu g times the step presses less
/// than Coulomb's limit.
///
/// Contacts are without bounce (restitution 0). One is made before it is reached and leaves a body at most the gap's
/// length for the next step: so nothing passes through anything at any speed, and whoever glances an edge may be led
/// past it up to (speed x step) early. Friction of the body is ODE's approximation: along the contact, at most its
/// coefficient times the normal force that would act without friction. Of two robots', the coefficient is the geometric
/// mean. Contacts that are pressed into each other all the same (between something on rails and a wall) are pushed
/// apart at 0.1 m/s at most.
///
/// Any number of engines on any number of threads, one thread at a time each.
class PhysicsEngine {
 public:
  /// Longest step that forces are held constant for. A world's step is cut into equal ones.
  static constexpr double kStep_s = 0.5e-3;
  static constexpr double kGravity_mps2 = 9.80665;

  /// Errors: kUnavailable: not in this build, or an ODE of single precision.
  static Result<std::unique_ptr<PhysicsEngine>> open();
  /// How many have been opened in this process: 0 says that ODE was never entered.
  static int opened();

  virtual ~PhysicsEngine() = default;
  PhysicsEngine(const PhysicsEngine&) = delete;
  PhysicsEngine& operator=(const PhysicsEngine&) = delete;

  using BodyId = std::uint32_t;
  /// Standing. The body's radius is > 0, and it has physics.
  virtual BodyId add(const RobotBody& robot, const Pose2& at) = 0;
  virtual void remove(BodyId body) = 0;

  /// What the wheels of a body do during a step.
  struct Drive {
    BodyId body = 0;
    GroundSpeeds rims;
  };
  /// What moves without asking: a disc that has this velocity during a step.
  struct Mover {
    FloorPoint at;
    double x_mps = 0, y_mps = 0;
    double radius_m = 0;
  };
  /// One step; `drives` are those of all bodies.
  virtual void step(double dt_s, const std::vector<Drive>& drives, const std::vector<Mover>& movers,
                    const std::vector<Part>& parts) = 0;

  struct Motion {
    Pose2 pose;
    double x_mps = 0, y_mps = 0;  ///< in the world
    double turn_radps = 0;
  };
  [[nodiscard]] virtual Motion motion(BodyId body) const = 0;

 protected:
  PhysicsEngine() = default;
};

}  // namespace twocone::sim_povray
