// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "localisation/odometry.h"
#include "vision/beam.h"

namespace twocone::behaviours {

using Outline = std::vector<Eigen::Vector2d>;  ///< corners of a simple polygon, world frame, metres

/// The area in which a robot may drive, according to its map: inside the walls and outside every obstacle.
struct Arena {
  Eigen::Vector2d min_m, max_m;
  std::vector<Outline> outlines;
  std::vector<Disc> discs;

  /// Returns the distance from `p_m` to the nearest wall or obstacle, metres; negative inside an obstacle or beyond a
  /// wall.
  [[nodiscard]] double clearance_m(const Eigen::Vector2d& p_m) const;
};

/// The motion of the body that a behaviour requests.
struct Motion {
  double speed_mps = 0;        ///< forward
  double turn_rate_radps = 0;  ///< counter-clockwise
};

/// Decides the motion of the body once per frame. A behaviour receives the believed pose and never the true one.
class Behaviour {
 public:
  virtual ~Behaviour() = default;
  /// @param believed world frame
  /// @param step_s time since the last decision, > 0
  virtual Motion decide(const localisation::Pose& believed, double step_s) = 0;
  /// Replaces the obstacles that were found on the way, besides those of the map.
  virtual void avoid(const std::vector<Disc>& /*found*/) {}
  /// Receives what the robot saw around itself. @param at its pose then, world frame
  virtual void see(const localisation::Pose& /*at*/, const std::vector<vision::Beam>& /*scan*/) {}
};

/// The limits of the body.
struct Body {
  double radius_m = 0;            ///< > 0
  double max_speed_mps = 0;       ///< of a wheel over the floor, > 0
  double wheel_separation_m = 0;  ///< > 0
};

/// Returns the turn rate of turns on the spot.
double turn_rate_on_the_spot(const Body& body);
/// Returns the motion towards a place. If its direction differs from the heading by more than half a radian, the
/// robot turns on the spot; otherwise it steers while it drives.
/// @param is_blocked it turns only
Motion towards(const Body& body, const localisation::Pose& believed, const Eigen::Vector2d& place_m, bool is_blocked);

/// Keeps the robot at rest for the whole run.
class Still final : public Behaviour {
 public:
  Motion decide(const localisation::Pose& believed, double step_s) override;
};

/// A motion as shares of the greatest speed and of the greatest turn rate, -1 to 1.
struct Shares {
  double speed = 0;  ///< forward
  double turn = 0;   ///< counter-clockwise

  friend bool operator==(const Shares&, const Shares&) = default;
};

/// Drives as somebody requests, frame by frame. It avoids nothing.
class Manual final : public Behaviour {
 public:
  /// @param requested returns the present request; values beyond -1 and 1 count as these, and those that are no numbers
  /// as rest
  Manual(const Body& body, std::function<Shares()> requested);
  /// Returns the requested motion. Where it would need a wheel faster than its top speed, both shares become smaller,
  /// so that the way stays the same.
  Motion decide(const localisation::Pose& believed, double step_s) override;

 private:
  Body body_;
  std::function<Shares()> requested_;
};

/// Drives as a function of the program that uses this library decides.
class Controlled final : public Behaviour {
 public:
  /// Decides as Behaviour::decide().
  using Decide = std::function<Motion(const localisation::Pose& believed, double step_s)>;
  explicit Controlled(Decide decide) : decide_(std::move(decide)) {}
  Motion decide(const localisation::Pose& believed, double step_s) override { return decide_(believed, step_s); }

 private:
  Decide decide_;
};

/// Wanders randomly as in section 3.1.2 of the paper. The robot drives forward until, according to the map, a wall or
/// an obstacle blocks it. It then turns to a random side for a random time and drives on. The seed determines all
/// random numbers.
///
/// The robot is blocked if two conditions hold for the clearance at the point kLookAhead_m in front of it. It is less
/// than the body radius plus a margin for the error of the believed pose, and it is less than at the present point. The
/// second condition lets a robot that is too close to an obstacle drive away. If the way is still blocked after a turn,
/// the robot continues to turn to the same side; otherwise it could be caught in a corner.
class Wander final : public Behaviour {
 public:
  static constexpr double kForward = 0.7;  ///< share of the top speed on the straight
  static constexpr double kTurning = 0.5;  ///< share of the top speed, each wheel, in a turn on the spot
  static constexpr double kLookAhead_m = 0.20;
  static constexpr double kMargin_m = 0.20;  ///< about seven times the paper's mean error
  static constexpr double kShortestTurn_s = 0.5;
  static constexpr double kLongestTurn_s = 3.8;  ///< a whole turn with the lab's wheels

  Wander(const Body& body, Arena arena, std::uint64_t seed);
  Motion decide(const localisation::Pose& believed, double step_s) override;
  void avoid(const std::vector<Disc>& found) override;

 private:
  [[nodiscard]] bool is_blocked(const localisation::Pose& believed) const;

  Body body_;
  Arena arena_;
  std::size_t discs_of_map_;
  std::mt19937_64 random_;
  double turn_left_s_ = 0;  ///< remaining time of the present turn
  double side_ = 0;         ///< +1 left, -1 right, 0 not turning
};

/// Drives from point to point, and from the last one back to the first.
class Waypoints final : public Behaviour {
 public:
  static constexpr double kReached_m = 0.10;

  /// @throws std::invalid_argument if there are no points
  Waypoints(const Body& body, std::vector<Eigen::Vector2d> points_m);
  Motion decide(const localisation::Pose& believed, double step_s) override;

 private:
  Body body_;
  std::vector<Eigen::Vector2d> points_m_;
  std::size_t next_ = 0;
};

}  // namespace twocone::behaviours
