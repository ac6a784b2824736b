// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "apps/behaviours/arena.h"
#include "localisation/odometry.h"

namespace twocone::behaviours {

/// What a behaviour wants the body to do.
struct Motion {
  double speed_mps = 0;        ///< forward
  double turn_rate_radps = 0;  ///< counter-clockwise
};

/// Decides once a frame where to go. It sees the pose that the robot believes, never the true one.
class Behaviour {
 public:
  virtual ~Behaviour() = default;
  /// @param believed world frame. @param step_s time since the last decision, > 0
  virtual Motion decide(const localisation::Pose& believed, double step_s) = 0;
};

/// What the body can do.
struct Body {
  double radius_m = 0;            ///< > 0
  double max_speed_mps = 0;       ///< of a wheel over the floor, > 0
  double wheel_separation_m = 0;  ///< > 0
};

/// Stands still.
class Still final : public Behaviour {
 public:
  Motion decide(const localisation::Pose& believed, double step_s) override;
};

/// Random wandering as in section 3.1.2 of the paper: forwards, checking the map, until at a pillar or wall; then a
/// turn to a random side for a random time; and on. Seeded.
///
/// "At" means: the place one look-ahead on has less room than the body and a margin for the error of the believed
/// pose, and less than there is here (so that a robot that finds itself too close may drive away). If the way is still
/// blocked after a turn, it turns on to the same side, so that a corner does not hold it.
class Wander final : public Behaviour {
 public:
  static constexpr double kForward = 0.7;  ///< share of the top speed on the straight
  static constexpr double kTurning = 0.5;  ///< share of the top speed, each wheel, in a turn on the spot
  static constexpr double kLookAhead_m = 0.20;
  static constexpr double kMargin_m = 0.20;  ///< seven times the paper's mean error
  static constexpr double kShortestTurn_s = 0.5;
  static constexpr double kLongestTurn_s = 3.8;  ///< a whole turn with the lab's wheels

  Wander(const Body& body, Arena arena, std::uint64_t seed);
  Motion decide(const localisation::Pose& believed, double step_s) override;

 private:
  [[nodiscard]] bool is_blocked(const localisation::Pose& believed) const;

  Body body_;
  Arena arena_;
  std::mt19937_64 random_;
  double turn_left_s_ = 0;  ///< what remains of the present turn
  double side_ = 0;         ///< +1 left, -1 right, 0 not turning
};

/// Drives from point to point, and from the last back to the first: turns on the spot towards a point that lies aside,
/// else steers at it while driving.
class Waypoints final : public Behaviour {
 public:
  static constexpr double kReached_m = 0.10;
  static constexpr double kTurnOnTheSpot_rad = 0.5;
  static constexpr double kSteering_1ps = 1.5;  ///< turn rate per radian of error

  /// @throws std::invalid_argument for no points
  Waypoints(const Body& body, std::vector<Eigen::Vector2d> points_m);
  Motion decide(const localisation::Pose& believed, double step_s) override;

 private:
  Body body_;
  std::vector<Eigen::Vector2d> points_m_;
  std::size_t next_ = 0;
};

}  // namespace twocone::behaviours
