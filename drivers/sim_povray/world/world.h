// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"
#include "drivers/sim_povray/world/motion.h"
#include "drivers/sim_povray/world/physics.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "drivers/sim_povray/world/wheel.h"
#include "hal/diff_drive.h"
#include "hal/result.h"

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
  /// Returns the arc at that time; nullptr while the robot stands.
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
  /// Returns the same as World::pose_before.
  [[nodiscard]] Pose2 pose_before(std::chrono::nanoseconds before) const;

  void command(const WheelSpeeds& speeds, std::chrono::nanoseconds now);
  void halt() { command_ = {}; }
  /// Lets the robot stand from now on and removes it from the physics engine.
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

/// The true state of a world: its time, and the poses of robots and moving things. It has no images, threads or locks.
///
/// Step n is at base + round((n - n_base) 1e9 / rate) ns, so that no error accumulates. Between two steps the wheels
/// turn at the commanded speeds (behind their lag, if they have one) until the dead-man time is over. From that
/// nanosecond on, the command is 0.
///
/// Each robot moves by exact arcs (with lag: by short ones, MovingRobot states the error). Where it touches something,
/// it stands, wheels included, until a command moves it away: it is stopped between 0.5e-9 m and 1e-9 m off, at any
/// speed. Turning on the spot counts as moving away. A robot of body radius 0 touches nothing, and nothing touches it.
/// Robots that drive at each other are both stopped. A moving thing is on rails: it continues over a robot that stands
/// in its way, and from then on that robot can move away from it but not deeper.
///
/// If its RobotBody has physics, the Open Dynamics Engine (physics.h) moves a robot; it is not used otherwise. The
/// wheels of such a robot turn as commanded even if its body slides or is blocked. For it, moving things and robots
/// without physics are on rails; the latter stop at it as at anything else.
///
/// The motion of one robot depends neither on the order in which robots joined (with physics: except for rounding) nor
/// on other robots' random numbers.
class World {
 public:
  explicit World(const PlaceSettings& place);  // requires a checked place

  [[nodiscard]] std::uint64_t step_number() const { return step_number_; }
  [[nodiscard]] std::chrono::nanoseconds now() const { return now_; }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  /// Sets the rate from the present step on. @param rate_hz > 0 and finite
  void set_rate(double rate_hz);
  /// Advances to the next step. Requires that a rate has been set.
  void step();
  /// Returns to time 0: moving things are at their initial poses, and the world has no robot. The rate stays.
  void begin_anew();

  using RobotId = std::uint32_t;
  /// Adds a robot at its `begin`, or at its `start` if it has none. An id is not used again until begin_anew().
  /// Errors: kRefused (that pose touches something, which is named), kUnavailable (physics in a build without it).
  Result<RobotId> add_robot(const RobotBody& robot);
  /// Leaves the robot where it is, standing, as an obstacle.
  void abandon(RobotId robot);
  /// Removes the robot: another one takes its place in the scene.
  void remove(RobotId robot);

  void command(RobotId robot, const WheelSpeeds& speeds) { robots_.at(robot).command(speeds, now_); }
  void halt(RobotId robot) { robots_.at(robot).halt(); }
  [[nodiscard]] const Pose2& pose(RobotId robot) const { return robots_.at(robot).pose(); }
  using Turned = MovingRobot::Turned;
  [[nodiscard]] const Turned& turned(RobotId robot) const { return robots_.at(robot).turned(); }
  /// Returns the name of the object that its body touches now: "wall", the name of a solid, "robot.2",
  /// "moving.trolley"; empty: none. If it touches several, the one that stopped it, else the nearest. A contact ends
  /// when the object is 1e-6 m away. A robot with physics touches every object within that distance.
  [[nodiscard]] const std::string& contact(RobotId robot) const { return robots_.at(robot).contact; }

  /// Returns the pose `before` earlier than now, from 0 to the last step plus kMaxStampLate_s. It lies on the exact
  /// path, up to the point of a stop (with physics: on straight lines between the engine's steps of 0.5 ms or less).
  /// Before the beginning of a robot or of the world, it is the initial pose.
  [[nodiscard]] Pose2 pose_before(RobotId robot, std::chrono::nanoseconds before) const {
    return robots_.at(robot).pose_before(before);
  }
  /// @param thing index in PlaceSettings::moving
  [[nodiscard]] Pose2 moving_pose_before(std::size_t thing, std::chrono::nanoseconds before) const;

 private:
  struct Thing {
    std::string name;
    MovingPath path;
    double speed_mps;
    double radius_m;
  };
  /// A robot to be stopped at the earliest touch, and the name of the object that stops it.
  struct Stop {
    MovingRobot* robot;
    const std::string* by;
  };

  void note(const Touch& touch, MovingRobot& a, const std::string& name_of_b, MovingRobot* b);
  void find_touches(RobotId id, MovingRobot& robot, double from_s, double to_s);
  /// Moves the robots without physics, each up to where its first touch stops it.
  void move_freely(double from_s, double to_s);
  void move_by_physics(double step_s);
  void update_contact(MovingRobot& robot) const;
  /// Calls visit(name, gap in m) for each object around a point now, except for `self`.
  template <typename Visit>
  void visit_neighbours(const FloorPoint& at, double radius_m, const MovingRobot* self, const Visit& visit) const;

  Surroundings surroundings_;
  std::vector<Thing> things_;
  std::map<RobotId, MovingRobot> robots_;
  RobotId next_robot_ = 0;
  std::unique_ptr<PhysicsEngine> engine_;

  double rate_hz_ = 0;
  std::uint64_t base_step_ = 0;
  std::chrono::nanoseconds base_{0};
  std::uint64_t step_number_ = 0;
  std::chrono::nanoseconds now_{0};

  // Stored from step to step to reuse their memory.
  double earliest_s_ = 0;
  std::vector<Stop> stops_;
  std::vector<PhysicsEngine::Drive> drives_;
  std::vector<PhysicsEngine::Mover> movers_;
};

/// Returns `turned_rad` as an encoder of `counts_per_turn` reports it: rounded down to a count; exact for 0 counts.
double encoder_reading_rad(double turned_rad, int counts_per_turn);

}  // namespace twocone::sim_povray
