// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "drivers/sim_povray/sim_povray.h"
#include "drivers/sim_povray/world/chance.h"
#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/physics.h"
#include "drivers/sim_povray/world/step_path.h"
#include "drivers/sim_povray/world/touch.h"
#include "drivers/sim_povray/world/wheel_course.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::sim_povray {

/// One robot of a world, step by step: begin_step() lays down the whole path that its wheels would drive, stop() cuts
/// it off where it touches something, end_step() goes to its end. Times within a step count from its beginning.
///
/// Without lag a step's path is one arc. With lag it is arcs of at most kLagArc_s, each at the mean speed of the wheels
/// over it, so that angles and heading are exact and only the place errs: after a command that changes the body's
/// speeds by dv and dw, of a body no faster than v and w, by at most
///     kLagArc_s^2 / 2 (dv w + v dw)
/// (|mean of v - v| over an arc is at most its change there, the heading is off by at most w kLagArc_s / 2 there; and
/// likewise for w). 0.5 m/s and 3 rad/s from standing: 1e-7 m. world_test.cpp,
/// ThePathAgreesWithAFineReferenceWithinTheStatedBound.
class MovingRobot {
 public:
  static constexpr double kLagArc_s = 0.25e-3;

  explicit MovingRobot(const RobotBody& body);  // taken as checked

  [[nodiscard]] const std::string& name() const { return body_.name; }
  [[nodiscard]] double radius_m() const { return body_.radius_m; }
  [[nodiscard]] const Pose2& pose() const { return path_.end; }
  [[nodiscard]] FloorPoint place() const { return {path_.end.x_m, path_.end.y_m}; }
  [[nodiscard]] const World::Turned& turned() const { return turned_; }
  /// As World::pose_before.
  [[nodiscard]] Pose2 pose_before(std::chrono::nanoseconds before) const;

  void command(const WheelSpeeds& speeds, std::chrono::nanoseconds now);
  void halt() { command_ = {}; }
  /// It stands from now on, and is no robot of the physics engine's any more.
  void abandon();

  void begin_step(std::chrono::nanoseconds now, std::chrono::nanoseconds span);
  /// The stretch of its path at `time_s`; of a robot of the physics engine, its velocity as it is.
  [[nodiscard]] Stretch stretch(double time_s) const;
  [[nodiscard]] double fastest_mps() const;
  [[nodiscard]] bool stands() const;  ///< for the rest of the step
  /// It touches something ahead: body and wheels stand from `time_s` to the end of the step. Where the wheels are to
  /// turn it on the spot they do so, and only the way that slip would lead it is not made.
  void stop(double time_s);
  void end_step();

  /// Which body of the physics engine it is, if it is one.
  std::optional<PhysicsEngine::BodyId> engine_body;
  /// What its wheels tell the floor over a part of the step, on average: their speed, changed by their slip.
  [[nodiscard]] GroundSpeeds rim_speeds(double from_s, double to_s) const;
  void be_moved(double to_s, const PhysicsEngine::Motion& motion);

  std::string contact;

 private:
  /// The last step's path becomes a past one.
  void begin_path(std::chrono::nanoseconds span);
  void add_arc(double begin_s, double end_s, const GroundSpeeds& ground);
  void add_lagging_arcs(double begin_s, double end_s);
  [[nodiscard]] bool turns_on_the_spot() const;
  void pin(double time_s);
  [[nodiscard]] GroundSpeeds on_floor(double left_radps, double right_radps) const;

  RobotBody body_;
  Slip left_slip_;
  Slip right_slip_;
  WheelSpeeds command_;
  std::chrono::nanoseconds commanded_at_{0};

  World::Turned turned_;
  WheelSpeeds lagging_;  ///< what the wheels do now, where they lag

  double step_s_ = 0;
  WheelCourse left_, right_;
  StepPath path_;              ///< its end is where the robot is
  std::deque<StepPath> past_;  ///< newest first; as many as cover kMaxStampLate_s
  std::chrono::nanoseconds past_span_{0};
  PhysicsEngine::Motion motion_;
  double fastest_mps_ = 0;
};

}  // namespace twocone::sim_povray
