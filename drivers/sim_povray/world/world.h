// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <random>

#include "drivers/sim_povray/sim_povray.h"

namespace twocone::sim_povray {

/// Relative slip of one wheel: a first-order Gauss-Markov process of stationary standard deviation sigma,
///     s' = a s + sigma sqrt(1 - a^2) n,   a = exp(-dt / tau),   n ~ N(0, 1),
/// begun from its stationary law. With sigma = 0 it draws nothing and is 0.
class Slip {
 public:
  Slip(double sigma, double correlation_s, std::mt19937_64 engine);
  [[nodiscard]] double value() const { return value_; }
  void advance(double dt_s);

 private:
  double sigma_;
  double correlation_s_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  double value_ = 0;
};

/// What each random engine of a world is for. One engine each, so that switching one effect on or off leaves the
/// others' draws as they were. The numbers go into the seed: they stay as they are.
enum class Purpose : std::uint32_t { kLeftSlip = 1, kRightSlip = 2 };

std::mt19937_64 engine_for(std::uint64_t seed, Purpose purpose);

/// The truth: time, the robot's pose and its wheels. Knows nothing of pictures.
///
/// Instant n is at base + round((n - n_base) 1e9 / rate) ns, so that no error adds up. Between two instants the wheels
/// turn at the speeds commanded, without lag, until the dead-man time is over: then they stand still from that very
/// nanosecond.
class World {
 public:
  /// `settings` are taken as checked (Simulation::open).
  explicit World(const WorldSettings& settings);

  [[nodiscard]] std::uint64_t tick() const { return tick_; }
  [[nodiscard]] Timestamp now() const { return {ClockKind::kSimulated, now_}; }
  [[nodiscard]] const Pose2& pose() const { return pose_; }

  /// How far the wheels have turned since the world began, to the last bit. Turning, not the way over the floor.
  struct Turned {
    double left_rad = 0;
    double right_rad = 0;
  };
  [[nodiscard]] const Turned& turned() const { return turned_; }

  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  /// From the present instant on. @param rate_hz > 0 and finite
  void set_rate(double rate_hz);

  void command(const WheelSpeeds& speeds);
  void halt() { speeds_ = {}; }

  /// To the next instant.
  void step();

 private:
  void drive_for(std::chrono::nanoseconds span);

  double separation_m_;
  double radius_m_;
  std::chrono::nanoseconds command_timeout_;
  Slip left_slip_;
  Slip right_slip_;

  double rate_hz_ = 0;
  std::uint64_t base_tick_ = 0;
  std::chrono::nanoseconds base_{0};

  std::uint64_t tick_ = 0;
  std::chrono::nanoseconds now_{0};
  Pose2 pose_;
  Turned turned_;
  WheelSpeeds speeds_;
  std::chrono::nanoseconds commanded_at_{0};
};

/// What an encoder of `counts_per_turn` tells of `turned_rad`: rounded down to a count; exact if it has 0 counts.
double encoder_reading_rad(double turned_rad, int counts_per_turn);

}  // namespace twocone::sim_povray
