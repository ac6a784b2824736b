// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include <fmt/format.h>

#include "base/random.h"

namespace twocone::testing_support {

/// Random numbers that are the same with every standard library. Of a standard library, the engines have this property,
/// the distributions do not.
class RandomDraws {
 public:
  explicit RandomDraws(std::uint64_t seed) : engine_(seed) {}

  /// Returns true with the given probability. Draws exactly one number for any probability, so the other faults do not
  /// shift if one fault is switched off.
  bool happens(double chance) { return base::fraction(engine_) < chance; }

  double between(double low, double high) { return low + (high - low) * base::fraction(engine_); }

  /// Returns a number in [0, count), count > 0. The modulo's bias, count / 2^64, does not matter for a fault.
  std::uint64_t below(std::uint64_t count) { return engine_() % count; }

  std::uint8_t byte() { return static_cast<std::uint8_t>(engine_()); }

 private:
  std::mt19937_64 engine_;
};

/// Returns a message if `chance` is not in [0, 1], to be joined with others; otherwise an empty string.
inline std::string complaint(const char* name, double chance) {
  return chance >= 0 && chance <= 1 ? "" : fmt::format(" {} is {}, must be in [0, 1];", name, chance);
}

}  // namespace twocone::testing_support
