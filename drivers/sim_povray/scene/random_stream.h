// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace twocone::sim_povray {

/// The random numbers of the scene language: `seed()` begins a stream and `rand()` takes its next number. Bit-equal
/// with the numbers that POV-Ray 3.7.0.10 prints.
class RandomStream {
 public:
  /// @param seed the scene's number without its fraction: POV-Ray drops it, so -1.7 becomes -1
  explicit constexpr RandomStream(int seed) : state_(static_cast<std::uint32_t>(seed)) {}

  /// Returns a number from 0 to 1, both included.
  constexpr double next() { return next_bits() / 4294967295.0; }

  /// Returns the 32 bits that next() turns into a number.
  constexpr std::uint32_t next_bits() {
    state_ = state_ * 1812433253U + 12345U;
    return state_;
  }

 private:
  std::uint32_t state_;
};

}  // namespace twocone::sim_povray
