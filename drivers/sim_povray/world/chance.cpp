// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/chance.h"

#include <cmath>

namespace twocone::sim_povray {

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
