// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"
#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {

/// The truth: time, and where robots and moving things are. Knows nothing of pictures. No thread, no lock.
///
/// Instant n is at base + round((n - n_base) 1e9 / rate) ns, so that no error adds up. Between two instants the wheels
/// turn at the speeds commanded (behind their lag, if they have one), until the dead-man time is over: then they are
/// told to stand still from that very nanosecond.
///
/// Each robot moves by exact arcs (with lag: by short ones, moving_robot.h states the error) and stands still where it
/// touches something, wheels included, until it is commanded away from it: it is stopped between 0.5e-9 m and 1e-9 m
/// off, at any speed. Turning on the spot is leading away. A robot of body radius 0 touches nothing and is touched by
/// nothing. Robots that drive at each other are both stopped. A moving thing is on rails: it goes on, over a robot that
/// stands in its way, which from then on can move away from it and not deeper.
///
/// If its RobotBody calls for physics, a robot moves by the Open Dynamics Engine (physics.h), which is not entered
/// otherwise: its wheels turn as commanded though the body slides or is blocked. For such a robot things, and robots
/// without physics, are on rails; those stop at it as at anything else.
///
/// What happens to one robot depends neither on the order in which robots came (with physics: but for rounding) nor on
/// other robots' random numbers.
class World {
 public:
  explicit World(const PlaceSettings& place);  // taken as checked
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  [[nodiscard]] std::uint64_t tick() const;
  [[nodiscard]] std::chrono::nanoseconds now() const;
  [[nodiscard]] double rate_hz() const;
  /// From the present instant on. @param rate_hz > 0 and finite
  void set_rate(double rate_hz);
  /// To the next instant. A rate has been set.
  void step();
  /// Back to time 0: moving things where they began, and no robot in it. The rate stays.
  void begin_anew();

  using RobotId = std::uint32_t;
  /// Puts a robot at its begin, or at its start if it has none. An id is not used again until begin_anew().
  /// Errors: kRefused: that place touches something, and what; kUnavailable: physics in a build without it.
  Result<RobotId> add_robot(const RobotBody& robot);
  /// The robot stays where it is, standing, as an obstacle.
  void abandon(RobotId robot);
  /// It is gone (its place in the scene is taken by another, or the world begins anew).
  void remove(RobotId robot);

  void command(RobotId robot, const WheelSpeeds& speeds);
  void halt(RobotId robot);
  [[nodiscard]] const Pose2& pose(RobotId robot) const;
  /// How far the wheels have turned since the robot was added, to the last bit. Turning, not the way over the floor.
  struct Turned {
    double left_rad = 0;
    double right_rad = 0;
  };
  [[nodiscard]] const Turned& turned(RobotId robot) const;
  /// What its body touches now: "wall", the name of a solid, "robot.2", "moving.trolley"; empty: nothing. Of several,
  /// the one that stopped it, else the nearest. Over once it is 1e-6 m away. A robot with physics touches what is
  /// within that.
  [[nodiscard]] const std::string& contact(RobotId robot) const;

  /// `thing` counts as PlaceSettings::moving does.
  [[nodiscard]] Pose2 moving_pose(std::size_t thing) const;

  /// Where things were `before` now, 0 <= before <= the last step and kMaxStampLate_s; on the very path they took, up
  /// to where they were stopped (with physics: on straight lines between the engine's steps of 0.5 ms or less). Before
  /// its beginning, a robot's or the world's, everything stood as at the beginning.
  [[nodiscard]] Pose2 pose_before(RobotId robot, std::chrono::nanoseconds before) const;
  [[nodiscard]] Pose2 moving_pose_before(std::size_t thing, std::chrono::nanoseconds before) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What an encoder of `counts_per_turn` tells of `turned_rad`: rounded down to a count; exact if it has 0 counts.
double encoder_reading_rad(double turned_rad, int counts_per_turn);

}  // namespace twocone::sim_povray
