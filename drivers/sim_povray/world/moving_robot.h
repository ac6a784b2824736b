// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/session_settings.h"
#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/physics.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "drivers/sim_povray/world/wheel.h"
#include "hal/diff_drive.h"

namespace twocone::sim_povray {

/// The path of one robot over one step of the world. Times are measured from the step's beginning.
struct StepPath {
  /// An arc leads from its beginning to that of the next arc; the last one leads to `end`.
  struct Arc {
    double begin_s, end_s;
    Pose2 from;
    BodySpeeds speeds;
  };
  /// A pose of a robot of the physics engine.
  struct Waypoint {
    double time_s;
    Pose2 pose;
  };

  std::chrono::nanoseconds span{0};
  Pose2 begin{};
  Pose2 end{};
  std::vector<Arc> arcs{};            ///< without gaps between them
  std::vector<Waypoint> waypoints{};  ///< instead of arcs
  std::optional<double> stopped_s{};  ///< the robot stands from then on, whatever the arcs are

  /// Starts a step at `here`, standing. Keeps the lists' memory.
  void begin_at(const Pose2& here, std::chrono::nanoseconds step);
  /// Returns nullptr while the robot stands.
  [[nodiscard]] const Arc* arc_at(double time_s) const;
  [[nodiscard]] Pose2 pose_at(double time_s) const;
};

/// One robot of a world, moved step by step. begin_step() computes the whole path that its wheels would drive, stop()
/// ends the path where the robot touches something, and end_step() moves to its end. Times within a step are measured
/// from its beginning.
///
/// Without lag, the path of a step is one arc. With lag, it is a sequence of arcs of at most kLagArc_s, each at the
/// mean speed of the wheels over it. Angles and heading are then exact, and only the position has an error. After a
/// command that changes the body's speeds by dv and dw, for a body no faster than v and w, the error is at most
///     kLagArc_s^2 / 2 (dv w + v dw)
/// (over an arc, |mean of v - v| is at most the change of v, and the heading is off by at most w kLagArc_s / 2;
/// likewise for w). For 0.5 m/s and 3 rad/s from standing, this is 1e-7 m. world_test.cpp,
/// ThePathAgreesWithAFineReferenceWithinTheStatedBound.
class MovingRobot {
 public:
  static constexpr double kLagArc_s = 0.25e-3;

  /// Angles that the wheels have turned since the robot was added, exact to the last bit. This is the turning, not the
  /// path over the floor.
  struct Turned {
    double left_rad = 0;
    double right_rad = 0;
  };

  explicit MovingRobot(const RobotBody& body);  // requires a checked body

  [[nodiscard]] const std::string& name() const { return body_.name; }
  [[nodiscard]] double radius_m() const { return body_.radius_m; }
  [[nodiscard]] const Pose2& pose() const { return path_.end; }
  [[nodiscard]] FloorPoint place() const { return {path_.end.x_m, path_.end.y_m}; }
  [[nodiscard]] const Turned& turned() const { return turned_; }
  /// Same as World::pose_before.
  [[nodiscard]] Pose2 pose_before(std::chrono::nanoseconds before) const;

  void command(const WheelSpeeds& speeds, std::chrono::nanoseconds now);
  void halt() { command_ = {}; }
  /// The robot stands from now on and no longer belongs to the physics engine.
  void abandon();

  void begin_step(std::chrono::nanoseconds now, std::chrono::nanoseconds span);
  /// Returns the stretch of its path at `time_s`; for a robot of the physics engine, at its present velocity.
  [[nodiscard]] Stretch stretch(double time_s) const;
  [[nodiscard]] double fastest_mps() const;
  [[nodiscard]] bool stands() const;  ///< for the rest of the step
  /// Stops the robot because it touches something ahead: body and wheels stand from `time_s` to the end of the step. If
  /// the wheels turn it on the spot, it continues to turn, and only the displacement by slip is left out.
  void stop(double time_s);
  void end_step();

  /// Its body in the physics engine, if it has one.
  std::optional<PhysicsEngine::BodyId> engine_body;
  /// Returns the mean rim speeds of its wheels over a part of the step, changed by their slip.
  [[nodiscard]] GroundSpeeds rim_speeds(double from_s, double to_s) const;
  void be_moved(double to_s, const PhysicsEngine::Motion& motion);

  std::string contact;

 private:
  /// Moves the last step's path to the past paths.
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

  Turned turned_;
  WheelSpeeds lagging_;  ///< present speeds of the wheels, if they lag

  double step_s_ = 0;
  WheelCourse left_, right_;
  StepPath path_;              ///< its end is the robot's present pose
  std::deque<StepPath> past_;  ///< newest first; enough to cover kMaxStampLate_s
  std::chrono::nanoseconds past_span_{0};
  PhysicsEngine::Motion motion_;
  double fastest_mps_ = 0;
};

}  // namespace twocone::sim_povray
