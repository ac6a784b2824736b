// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "drivers/sim_povray/scene/random_stream.h"

namespace twocone::sim_povray {

/// Noise and cells repeat after this many units along every axis.
constexpr std::size_t kShuffledCount = 4096;

/// Returns the order of the integers below kShuffledCount by which noise and cells choose their numbers. The order that
/// was measured is that of a shuffle by POV-Ray's own random numbers.
constexpr std::array<std::uint16_t, kShuffledCount> shuffled_integers() {
  std::array<std::uint16_t, kShuffledCount> order{};
  for (std::size_t i = 0; i < kShuffledCount; ++i) order[i] = static_cast<std::uint16_t>(i);
  RandomStream random(0);
  for (std::size_t i = kShuffledCount; i-- > 0;)
    std::swap(order[i], order[(random.next_bits() >> 16) % kShuffledCount]);
  return order;
}

inline constexpr auto kShuffled = shuffled_integers();

}  // namespace twocone::sim_povray
