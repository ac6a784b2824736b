// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "drivers/sim_povray/world/motion.h"

namespace twocone::sim_povray {
namespace {

double seconds(std::chrono::nanoseconds span) { return std::chrono::duration<double>(span).count(); }

}  // namespace

Slip::Slip(double sigma, double correlation_s, std::mt19937_64 engine)
    : sigma_(sigma), correlation_s_(correlation_s), engine_(engine) {
  if (sigma_ > 0) value_ = sigma_ * normal_(engine_);
}

void Slip::advance(double dt_s) {
  if (sigma_ <= 0) return;
  const double a = std::exp(-dt_s / correlation_s_);
  // 1 - a^2 by expm1: the plain form loses every digit when dt is far below the time constant.
  value_ = a * value_ + sigma_ * std::sqrt(-std::expm1(-2 * dt_s / correlation_s_)) * normal_(engine_);
}

std::mt19937_64 engine_for(std::uint64_t seed, Purpose purpose) {
  std::seed_seq words{std::uint32_t(seed & 0xffffffffU), std::uint32_t(seed >> 32), std::uint32_t(purpose)};
  return std::mt19937_64(words);
}

World::World(const WorldSettings& settings)
    : separation_m_(settings.wheels.separation_m),
      radius_m_(settings.wheels.radius_m),
      command_timeout_(settings.drive.command_timeout),
      left_slip_(settings.wheels.slip, settings.wheels.slip_correlation_s,
                 engine_for(settings.seed, Purpose::kLeftSlip)),
      right_slip_(settings.wheels.slip, settings.wheels.slip_correlation_s,
                  engine_for(settings.seed, Purpose::kRightSlip)),
      pose_{settings.start.x_m, settings.start.y_m, wrap_angle(settings.start.heading_rad)} {}

void World::set_rate(double rate_hz) {
  assert(rate_hz > 0);
  if (rate_hz == rate_hz_) return;
  rate_hz_ = rate_hz;
  base_tick_ = tick_;
  base_ = now_;
}

void World::command(const WheelSpeeds& speeds) {
  speeds_ = speeds;
  commanded_at_ = now_;
}

void World::step() {
  assert(rate_hz_ > 0);
  const std::chrono::nanoseconds next =
      base_ + std::chrono::nanoseconds(std::llround(double(tick_ + 1 - base_tick_) * 1e9 / rate_hz_));
  // As a difference: now + timeout would overflow for a time-out of centuries.
  const auto alive = std::max(command_timeout_ - (now_ - commanded_at_), std::chrono::nanoseconds(0));
  const auto driven = std::min(alive, next - now_);
  if (speeds_ != WheelSpeeds{} && driven.count() > 0) drive_for(driven);

  left_slip_.advance(seconds(next - now_));
  right_slip_.advance(seconds(next - now_));
  now_ = next;
  ++tick_;
}

void World::drive_for(std::chrono::nanoseconds span) {
  const double dt_s = seconds(span);
  const GroundSpeeds ground{speeds_.left_radps * radius_m_ * (1 + left_slip_.value()),
                            speeds_.right_radps * radius_m_ * (1 + right_slip_.value())};
  pose_ = advance(pose_, body_speeds(ground, separation_m_), dt_s);
  turned_.left_rad += speeds_.left_radps * dt_s;
  turned_.right_rad += speeds_.right_radps * dt_s;
}

double encoder_reading_rad(double turned_rad, int counts_per_turn) {
  if (counts_per_turn == 0) return turned_rad;
  constexpr double kTurn_rad = 2 * std::numbers::pi;
  return std::floor(turned_rad / kTurn_rad * counts_per_turn) / counts_per_turn * kTurn_rad;
}

}  // namespace twocone::sim_povray
