// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/wheel.h"

#include <algorithm>
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

}  // namespace twocone::sim_povray
