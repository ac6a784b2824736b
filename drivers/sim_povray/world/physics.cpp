// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/physics.h"

#include <ode/ode.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include "drivers/sim_povray/world/surroundings.h"
#include "drivers/sim_povray/world/wheel.h"

namespace twocone::sim_povray {
namespace {

std::atomic<int> opened_engines{0};

/// Initialises ODE once in a process and registers each thread that calls it; returns whether ODE can be used. It is
/// never closed: dCloseODE requires that no thread that has called ODE is alive, which only a whole program can
/// promise. The data of a thread are freed when it ends.
bool enter_ode() {
  static const bool begun = dInitODE2(0) != 0 && dCheckConfiguration("ODE_double_precision") != 0;
  thread_local const bool known = begun && dAllocateODEDataForThread(dAllocateFlagBasicData) != 0;
  return known;
}

class OdeEngine final : public PhysicsEngine {
 public:
  OdeEngine()
      : threading_(dThreadingAllocateSelfThreadedImplementation()),
        world_(dWorldCreate()),
        contacts_(dJointGroupCreate(0)) {
    // A world of ODE steps through a list of jobs, which by default all worlds share, without a lock.
    dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(threading_), threading_);
    dWorldSetContactMaxCorrectingVel(world_, 0.1);
    dWorldSetAutoDisableFlag(world_, 0);
    // No gravity: the wheels' friction is computed from a fixed load, and no body leaves the plane.
  }
  ~OdeEngine() override {
    enter_ode();
    dJointGroupDestroy(contacts_);
    dWorldDestroy(world_);
    dThreadingFreeImplementation(threading_);
  }

  BodyId add(const RobotBody& robot, const Pose2& at) override {
    enter_ode();
    const Physics& physics = *robot.physics;
    Body body;
    body.id = disc_body({at.x_m, at.y_m});
    body.radius_m = robot.radius_m;
    body.body_friction = physics.body_friction;
    body.wheels = {physics.mass_kg, physics.mass_kg * robot.radius_m * robot.radius_m / 2, robot.wheels.separation_m,
                   physics.wheel_friction * physics.mass_kg * kGravity_mps2 / 2};
    body.motion.pose = at;
    dMass mass;
    // Only the moment about z counts in the plane; the others only have to make the body valid.
    const double inertia = body.wheels.inertia_kgm2;
    dMassSetParameters(&mass, physics.mass_kg, 0, 0, 0, inertia, inertia, inertia, 0, 0, 0);
    dBodySetMass(body.id, &mass);
    // A disc looks the same at any heading, so the heading is stored here, and ODE's own rotation is not read.
    body.plane = dJointCreatePlane2D(world_, nullptr);
    dJointAttach(body.plane, body.id, nullptr);
    bodies_.emplace(next_body_, body);
    return next_body_++;
  }

  void remove(BodyId body) override {
    enter_ode();
    const auto found = bodies_.find(body);
    dJointDestroy(found->second.plane);
    dBodyDestroy(found->second.id);
    bodies_.erase(found);
  }

  void step(double dt_s, const std::vector<Drive>& drives, const std::vector<Mover>& movers,
            const std::vector<Part>& parts) override {
    enter_ode();
    place_movers(movers);
    double fastest_mps = 0;
    for (const Mover& m : movers) fastest_mps = std::max(fastest_mps, std::hypot(m.x_mps, m.y_mps));
    for (const Drive& d : drives) {
      Body& body = bodies_.at(d.body);
      drive(body, dt_s, d.rims);
      // The wheels can add mu g dt. A push adds at most the speed of the body that pushes.
      fastest_mps = std::max(fastest_mps, std::hypot(body.motion.x_mps, body.motion.y_mps) +
                                              2 * body.wheels.most_N / body.wheels.mass_kg * dt_s);
    }
    touch_all(dt_s, 2 * fastest_mps * dt_s + kGap_m, movers, parts);
    dWorldStep(world_, dt_s);
    dJointGroupEmpty(contacts_);
    for (auto& [id, body] : bodies_) {
      const dReal* place = dBodyGetPosition(body.id);
      const dReal* speed = dBodyGetLinearVel(body.id);
      const double turn_radps = dBodyGetAngularVel(body.id)[2];
      body.motion = {{place[0], place[1], wrap_angle(body.motion.pose.heading_rad + turn_radps * dt_s)},
                     speed[0],
                     speed[1],
                     turn_radps};
    }
  }

  [[nodiscard]] Motion motion(BodyId body) const override { return bodies_.at(body).motion; }

 private:
  struct Body {
    dBodyID id = nullptr;
    dJointID plane = nullptr;
    double radius_m = 0;
    double body_friction = 0;
    WheelFriction wheels;
    Motion motion;
  };
  /// A contact already made for the present body, so that the corner of two edges is touched once.
  struct Made {
    double gap_m, x, y;
  };

  dBodyID disc_body(const FloorPoint& at) {
    dBodyID id = dBodyCreate(world_);
    dBodySetPosition(id, at.x_m, at.y_m, 0);
    return id;
  }

  void drive(Body& body, double dt_s, const GroundSpeeds& rims) const {
    const Motion& m = body.motion;
    // The heading at the step's middle makes a turning robot's path accurate to second order.
    const double along_rad = m.pose.heading_rad + m.turn_radps * dt_s / 2;
    const double c = std::cos(along_rad);
    const double s = std::sin(along_rad);
    const FloorImpulse impulse =
        wheel_impulse(body.wheels, {c * m.x_mps + s * m.y_mps, -s * m.x_mps + c * m.y_mps, m.turn_radps}, rims, dt_s);
    dBodyAddForce(body.id, (c * impulse.ahead_Ns - s * impulse.left_Ns) / dt_s,
                  (s * impulse.ahead_Ns + c * impulse.left_Ns) / dt_s, 0);
    dBodyAddTorque(body.id, 0, 0, impulse.turn_Nms / dt_s);
  }

  void place_movers(const std::vector<Mover>& movers) {
    while (mover_bodies_.size() < movers.size()) {
      mover_bodies_.push_back(disc_body({0, 0}));
      dBodySetKinematic(mover_bodies_.back());
    }
    for (std::size_t i = 0; i < movers.size(); ++i) {
      dBodySetPosition(mover_bodies_[i], movers[i].at.x_m, movers[i].at.y_m, 0);
      dBodySetLinearVel(mover_bodies_[i], movers[i].x_mps, movers[i].y_mps, 0);
    }
  }

  /// Makes a contact if the other body is within reach.
  void touch(const Body& body, dBodyID other, const Facing& face, double friction, double dt_s, double reach_m) {
    constexpr double kSame = 1e-9;
    const double gap_m = face.distance_m - body.radius_m;
    if (gap_m > reach_m || (face.x == 0 && face.y == 0)) return;
    const auto is_same = [&](const Made& m) {
      return std::abs(m.gap_m - gap_m) < kSame && std::abs(m.x - face.x) < kSame && std::abs(m.y - face.y) < kSame;
    };
    if (std::any_of(made_.begin(), made_.end(), is_same)) return;
    made_.push_back({gap_m, face.x, face.y});

    dContact contact{};
    contact.surface.mode = dContactApprox1_1 | dContactMu2 | dContactFDir1 | dContactMotionN;
    contact.surface.mu = friction;
    contact.surface.mu2 = 0;
    // The bodies may approach by the gap and no more: ODE's target speed along the normal is below 0.
    contact.surface.motionN = -std::max(gap_m, 0.0) / dt_s;
    contact.geom.depth = std::max(-gap_m, 0.0);
    const Pose2& at = body.motion.pose;
    contact.geom.pos[0] = at.x_m - body.radius_m * face.x;
    contact.geom.pos[1] = at.y_m - body.radius_m * face.y;
    contact.geom.normal[0] = face.x;
    contact.geom.normal[1] = face.y;
    contact.fdir1[0] = -face.y;
    contact.fdir1[1] = face.x;
    dJointAttach(dJointCreateContact(world_, contacts_, &contact), body.id, other);
  }

  void touch_all(double dt_s, double reach_m, const std::vector<Mover>& movers, const std::vector<Part>& parts) {
    for (auto it = bodies_.begin(); it != bodies_.end(); ++it) {
      const Body& body = it->second;
      const FloorPoint at{body.motion.pose.x_m, body.motion.pose.y_m};
      made_.clear();
      for (const Part& part : parts) {
        touch(body, nullptr, facing(part, at), body.body_friction, dt_s, reach_m);
      }
      for (std::size_t i = 0; i < movers.size(); ++i) {
        const Facing face = facing(Disc{movers[i].at, movers[i].radius_m}, at);
        touch(body, mover_bodies_[i], face, body.body_friction, dt_s, reach_m);
      }
      for (auto other = std::next(it); other != bodies_.end(); ++other) {
        const Pose2& there = other->second.motion.pose;
        const Facing face = facing(Disc{{there.x_m, there.y_m}, other->second.radius_m}, at);
        const double friction = std::sqrt(body.body_friction * other->second.body_friction);
        touch(body, other->second.id, face, friction, dt_s, reach_m);
      }
    }
  }

  dThreadingImplementationID threading_;
  dWorldID world_;
  dJointGroupID contacts_;
  std::map<BodyId, Body> bodies_;
  BodyId next_body_ = 0;
  std::vector<dBodyID> mover_bodies_;
  std::vector<Made> made_;
};

}  // namespace

Result<std::unique_ptr<PhysicsEngine>> PhysicsEngine::open() {
  if (!enter_ode()) {
    return Error{ErrorCode::kUnavailable,
                 "physics needs an Open Dynamics Engine of double precision, which this is not"};
  }
  ++opened_engines;
  return std::unique_ptr<PhysicsEngine>(std::make_unique<OdeEngine>());
}

int PhysicsEngine::opened() { return opened_engines; }

}  // namespace twocone::sim_povray
