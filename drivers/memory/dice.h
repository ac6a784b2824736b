// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include <fmt/format.h>

namespace twocone::memory {

/// Random numbers that are the same on every standard library: its engines are, its distributions are not.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}

  /// True with the given chance. Draws exactly one number whatever the chance, so that switching one fault off leaves
  /// the others where they were.
  bool happens(double chance) { return fraction() < chance; }

  double between(double low, double high) { return low + (high - low) * fraction(); }

  /// In [0, count), count > 0; the modulo's bias, count / 2^64, does not matter to a fault.
  std::uint64_t below(std::uint64_t count) { return engine_() % count; }

  std::uint8_t byte() { return static_cast<std::uint8_t>(engine_()); }

 private:
  /// In [0, 1), of 53 random bits: all that a double in that range holds.
  double fraction() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  std::mt19937_64 engine_;
};

/// A complaint if `chance` is not in [0, 1], to be put together with others.
inline std::string complaint(const char* name, double chance) {
  return chance >= 0 && chance <= 1 ? "" : fmt::format(" {} is {}, must be in [0, 1];", name, chance);
}

}  // namespace twocone::memory
