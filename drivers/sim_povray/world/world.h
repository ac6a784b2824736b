// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/robot_body.h"
#include "drivers/sim_povray/world/motion.h"
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
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  [[nodiscard]] std::uint64_t step_number() const;
  [[nodiscard]] std::chrono::nanoseconds now() const;
  [[nodiscard]] double rate_hz() const;
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

  void command(RobotId robot, const WheelSpeeds& speeds);
  void halt(RobotId robot);
  [[nodiscard]] const Pose2& pose(RobotId robot) const;
  /// Angles that the wheels have turned since the robot was added, exact to the last bit. This is the turning, not the
  /// path over the floor.
  struct Turned {
    double left_rad = 0;
    double right_rad = 0;
  };
  [[nodiscard]] const Turned& turned(RobotId robot) const;
  /// Returns the name of the object that its body touches now: "wall", the name of a solid, "robot.2",
  /// "moving.trolley"; empty: none. If it touches several, the one that stopped it, else the nearest. A contact ends
  /// when the object is 1e-6 m away. A robot with physics touches every object within that distance.
  [[nodiscard]] const std::string& contact(RobotId robot) const;

  /// @param thing index in PlaceSettings::moving
  [[nodiscard]] Pose2 moving_pose(std::size_t thing) const;

  /// Returns the pose `before` earlier than now, from 0 to the last step plus kMaxStampLate_s. It lies on the exact
  /// path, up to the point of a stop (with physics: on straight lines between the engine's steps of 0.5 ms or less).
  /// Before the beginning of a robot or of the world, it is the initial pose.
  [[nodiscard]] Pose2 pose_before(RobotId robot, std::chrono::nanoseconds before) const;
  [[nodiscard]] Pose2 moving_pose_before(std::size_t thing, std::chrono::nanoseconds before) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns `turned_rad` as an encoder of `counts_per_turn` reports it: rounded down to a count; exact for 0 counts.
double encoder_reading_rad(double turned_rad, int counts_per_turn);

}  // namespace twocone::sim_povray
