// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/wheel.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace twocone::sim_povray {
namespace {

double lagging_turn_rad(double from_radps, double to_radps, double lag_s, double time_s) {
  return to_radps * time_s - (from_radps - to_radps) * lag_s * std::expm1(-time_s / lag_s);
}

double lagging_speed_radps(double from_radps, double to_radps, double lag_s, double time_s) {
  constexpr double kThere_radps = 1e-12;
  const double behind_radps = (from_radps - to_radps) * std::exp(-time_s / lag_s);
  return std::abs(behind_radps) < kThere_radps ? to_radps : to_radps + behind_radps;
}

struct WheelImpulse {
  double ahead_Ns = 0;
  double left_Ns = 0;
};

FloorImpulse sum(const std::array<WheelImpulse, 2>& p, double arm_m) {
  return {p[0].ahead_Ns + p[1].ahead_Ns, p[0].left_Ns + p[1].left_Ns, arm_m * (p[1].ahead_Ns - p[0].ahead_Ns)};
}

WheelImpulse within(const WheelImpulse& p, double most_Ns) {
  const double size_Ns = std::hypot(p.ahead_Ns, p.left_Ns);
  return size_Ns <= most_Ns ? p : WheelImpulse{p.ahead_Ns * (most_Ns / size_Ns), p.left_Ns * (most_Ns / size_Ns)};
}

}  // namespace

double WheelCourse::turned_rad(double time_s) const {
  const double commanded_s = std::min(time_s, driven_s);
  if (lag_s == 0) return command_radps * commanded_s;
  double turned_rad = lagging_turn_rad(begin_radps, command_radps, lag_s, commanded_s);
  if (time_s > driven_s) {
    const double then_radps = lagging_speed_radps(begin_radps, command_radps, lag_s, driven_s);
    turned_rad += lagging_turn_rad(then_radps, 0, lag_s, time_s - driven_s);
  }
  return turned_rad;
}

double WheelCourse::speed_radps(double time_s) const {
  if (lag_s == 0) return time_s < driven_s ? command_radps : 0;
  const double then_radps = lagging_speed_radps(begin_radps, command_radps, lag_s, std::min(time_s, driven_s));
  return time_s > driven_s ? lagging_speed_radps(then_radps, 0, lag_s, time_s - driven_s) : then_radps;
}

std::mt19937_64 engine_for(std::uint64_t seed, Purpose purpose) {
  std::seed_seq words{std::uint32_t(seed & 0xffffffffU), std::uint32_t(seed >> 32), std::uint32_t(purpose)};
  return std::mt19937_64(words);
}

Slip::Slip(double sigma, double correlation_s, std::mt19937_64 engine)
    : sigma_(sigma), correlation_s_(correlation_s), engine_(engine) {
  if (sigma_ > 0) value_ = sigma_ * normal_(engine_);
}

void Slip::advance(double dt_s) {
  if (sigma_ <= 0) return;
  const double a = std::exp(-dt_s / correlation_s_);
  // 1 - a^2 is computed by expm1: the plain form loses every digit if dt is far below the time constant.
  value_ = a * value_ + sigma_ * std::sqrt(-std::expm1(-2 * dt_s / correlation_s_)) * normal_(engine_);
}

FloorImpulse wheel_impulse(const WheelFriction& wheels, const FloorVelocity& before, const GroundSpeeds& rims,
                           double dt_s) {
  const double arm_m = wheels.separation_m / 2;
  const double most_Ns = wheels.most_N * dt_s;
  const BodySpeeds wanted = body_speeds(rims, wheels.separation_m);

  // If both wheels grip, the body takes the rims' speeds immediately. This does not determine how the wheels share the
  // impulse across; equal halves are the smallest.
  const double ahead_Ns = wheels.mass_kg * (wanted.speed_mps - before.ahead_mps);
  const double turn_Nms = wheels.inertia_kgm2 * (wanted.turn_radps - before.turn_radps);
  const double left_Ns = -wheels.mass_kg * before.left_mps;
  std::array<WheelImpulse, 2> p{WheelImpulse{ahead_Ns / 2 - turn_Nms / (2 * arm_m), left_Ns / 2},
                                WheelImpulse{ahead_Ns / 2 + turn_Nms / (2 * arm_m), left_Ns / 2}};
  if (std::max(std::hypot(p[0].ahead_Ns, p[0].left_Ns), std::hypot(p[1].ahead_Ns, p[1].left_Ns)) <= most_Ns) {
    return sum(p, arm_m);
  }

  // A's eigenvalues are 2/m along, 2 arm^2/I for turning, and 2/m and 0 across.
  const double step_kg = 0.5 / std::max(1 / wheels.mass_kg, arm_m * arm_m / wheels.inertia_kgm2);
  const double close_Ns = 1e-12 * most_Ns;
  const std::array<double, 2> side{-1, 1};
  const std::array<double, 2> rim_mps{rims.left_mps, rims.right_mps};
  for (WheelImpulse& wheel : p) wheel = within(wheel, most_Ns);
  std::array<WheelImpulse, 2> ahead = p;  // p, extrapolated along its last change
  double momentum = 1;
  for (int round = 0; round < 1000; ++round) {
    const FloorImpulse all = sum(ahead, arm_m);
    std::array<WheelImpulse, 2> next;
    double change_Ns = 0;
    double uphill = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const double ahead_mps = before.ahead_mps + all.ahead_Ns / wheels.mass_kg +
                               side[i] * arm_m * (before.turn_radps + all.turn_Nms / wheels.inertia_kgm2) - rim_mps[i];
      const double left_mps = before.left_mps + all.left_Ns / wheels.mass_kg;
      next[i] = within({ahead[i].ahead_Ns - step_kg * ahead_mps, ahead[i].left_Ns - step_kg * left_mps}, most_Ns);
      const double x_Ns = next[i].ahead_Ns - p[i].ahead_Ns;
      const double y_Ns = next[i].left_Ns - p[i].left_Ns;
      change_Ns = std::max(
          {change_Ns, std::abs(next[i].ahead_Ns - ahead[i].ahead_Ns), std::abs(next[i].left_Ns - ahead[i].left_Ns)});
      uphill += (ahead[i].ahead_Ns - next[i].ahead_Ns) * x_Ns + (ahead[i].left_Ns - next[i].left_Ns) * y_Ns;
    }
    // The momentum is restarted wherever it went against the gradient (O'Donoghue and Candes 2015).
    const double after = uphill > 0 ? 1 : (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
    const double on = uphill > 0 ? 0 : (momentum - 1) / after;
    for (std::size_t i = 0; i < p.size(); ++i) {
      ahead[i] = {next[i].ahead_Ns + on * (next[i].ahead_Ns - p[i].ahead_Ns),
                  next[i].left_Ns + on * (next[i].left_Ns - p[i].left_Ns)};
    }
    momentum = after;
    p = next;
    if (change_Ns <= close_Ns) break;
  }
  return sum(p, arm_m);
}

}  // namespace twocone::sim_povray
