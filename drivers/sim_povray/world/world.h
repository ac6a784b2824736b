// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"
#include "drivers/sim_povray/world/moving_robot.h"
#include "drivers/sim_povray/world/physics.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "hal/diff_drive.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// The true state of a world: its time, and the poses of robots and moving things. Holds no images. No thread, no lock.
///
/// Step n is at base + round((n - n_base) 1e9 / rate) ns, so that no error accumulates. Between two steps the wheels
/// turn at the commanded speeds (behind their lag, if they have one) until the dead-man time is over; from that very
/// nanosecond on they are commanded to stand.
///
/// Each robot moves by exact arcs (with lag: by short ones, moving_robot.h states the error). Where it touches
/// something it stands, wheels included, until it is commanded away from it: it is stopped between 0.5e-9 m and 1e-9 m
/// off, at any speed. Turning on the spot counts as moving away. A robot of body radius 0 touches nothing, and nothing
/// touches it. Robots that drive at each other are both stopped. A moving thing is on rails: it continues over a robot
/// that stands in its way, and from then on that robot can move away from it but not deeper.
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
  /// Errors: kRefused: that pose touches something, with its name; kUnavailable: physics in a build without it.
  Result<RobotId> add_robot(const RobotBody& robot);
  /// The robot stays where it is, standing, as an obstacle.
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
