// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/sim_povray/session_settings.h"
#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// Moves robots with mass in the floor's plane by the Open Dynamics Engine. Only a world that has such a robot uses it.
///
/// A robot is a uniform disc, I = m R^2 / 2, with the wheels at y = +-separation / 2. Each wheel always carries m g /
/// 2: no load moves from wheel to wheel when the robot accelerates or turns. At each wheel's contact point, friction
/// drives the speed along the wheel to that of its rim and the speed across it to zero, with at most mu m g / 2 in any
/// direction: Coulomb's circle. The impulses of the two wheels over a step are those after which the points slide least
/// (the convex problem of greatest dissipation, with the velocity at the step's end). This is stable for any length of
/// the step, and exact in both extremes, gripping and sliding. The impulses are found before the forces of contacts,
/// and so without them. For a robot that is pressed against something, a rim speed below mu g times the step therefore
/// presses less than Coulomb's limit.
///
/// Contacts are without bounce (restitution 0). A contact is made before it is reached, and lets a body move by at most
/// the gap's length in the next step. Nothing therefore passes through anything at any speed, and a body that grazes an
/// edge may be led past it up to (speed x step) early. Friction of the body is ODE's approximation: it acts along the
/// contact, and is at most its coefficient times the normal force that would act without friction. For two robots, the
/// coefficient is the geometric mean. Contacts that still penetrate each other (between an object on rails and a wall)
/// are pushed apart at 0.1 m/s at most.
///
/// Any number of engines may be used on any number of threads, each engine by one thread at a time.
class PhysicsEngine {
 public:
  /// Longest step over which forces are held constant. A world's step is divided into equal ones.
  static constexpr double kStep_s = 0.5e-3;
  static constexpr double kGravity_mps2 = 9.80665;

  /// Opens an engine. Errors: kUnavailable (this build has no ODE, or one of single precision).
  static Result<std::unique_ptr<PhysicsEngine>> open();
  /// Returns the number of engines opened in this process; 0 shows that ODE was never used.
  static int opened();

  virtual ~PhysicsEngine() = default;
  PhysicsEngine(const PhysicsEngine&) = delete;
  PhysicsEngine& operator=(const PhysicsEngine&) = delete;

  using BodyId = std::uint32_t;
  /// Adds a body that stands. Requires a radius > 0 and physics.
  virtual BodyId add(const RobotBody& robot, const Pose2& at) = 0;
  virtual void remove(BodyId body) = 0;

  /// Speeds of a body's wheel rims during a step.
  struct Drive {
    BodyId body = 0;
    GroundSpeeds rims;
  };
  /// A disc on rails, which has this velocity during a step.
  struct Mover {
    FloorPoint at;
    double x_mps = 0, y_mps = 0;
    double radius_m = 0;
  };
  /// Advances by one step. `drives` holds the rim speeds of all bodies.
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
