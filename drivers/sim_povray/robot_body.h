// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "base/plane.h"

namespace twocone::sim_povray {

/// True properties of the wheels.
struct WheelSettings {
  double separation_m = 0.30;  ///< between the wheels' contact points, > 0
  double radius_m = 0.05;      ///< > 0
  /// Standard deviation of each wheel's relative slip, >= 0 (0: none): a wheel's path over the floor is (1 + slip)
  /// times its turning. The slip is a first-order Gauss-Markov process, one per wheel, of stationary standard deviation
  /// `slip`.
  double slip = 0;
  double slip_correlation_s = 2.0;  ///< time constant of that process, > 0
  int encoder_counts_per_turn = 0;  ///< read_angles() rounds down to counts; 0: exact angles
  /// Time constant of the actuators, >= 0 (0: none): a wheel's speed w follows its command u by w' = (u - w) / lag.
  double lag_s = 0;
};

/// Mass and friction. The physics engine moves a robot that has them.
struct Physics {
  double mass_kg = 5.0;  ///< > 0; the moment of inertia is that of a uniform disc of the body's radius
  double wheel_friction =
      0.8;                     ///< Coulomb coefficient between wheel and floor, > 0; each wheel carries half the weight
  double body_friction = 0.3;  ///< between the body and the objects that it touches, >= 0
};

/// The part of a robot that the world moves.
struct RobotBody {
  std::string name = "robot";  ///< name in the messages of other robots
  Pose2 start;                 ///< pose at which the scene shows the robot; the heading is wrapped to (-pi, pi]
  double radius_m = 0;         ///< radius of the disc for contacts, >= 0; 0: it touches nothing
  WheelSettings wheels;
  std::chrono::nanoseconds command_timeout{500'000'000};  ///< dead-man time, > 0
  std::optional<Physics> physics{};
  std::uint64_t seed = 1;  ///< seed of all random processes of this robot
  /// Pose at time 0, if it differs from `start`.
  std::optional<Pose2> begin{};
  std::string start_place{};  ///< source of `start`, for messages: "robots/lab_sim.yaml:17"; empty: unknown
};

}  // namespace twocone::sim_povray
