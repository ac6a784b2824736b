// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace twocone::sim_povray {
namespace {

/// FNV-1a hash, 64 bits: the same on every machine, unlike std::hash.
std::uint64_t hash(std::string_view text) {
  std::uint64_t value = 0xcbf29ce484222325U;
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return value;
}

/// Layers of equal area under exp(-x^2 / 2); layer 0 is the base with the tail.
struct Ziggurat {
  static constexpr std::size_t kLayers = 128;
  static constexpr double kTailFrom = 3.442619855899;   ///< Doornik's table 1, for 128 layers
  static constexpr double kArea = 9.91256303526217e-3;  ///< of each layer
  std::array<double, kLayers + 1> width{};              ///< of each layer; the base's as if it were a rectangle
  std::array<double, kLayers> inside{};                 ///< share of a layer's width that lies wholly under the curve

  Ziggurat() {
    double height = std::exp(-0.5 * kTailFrom * kTailFrom);
    width[0] = kArea / height;
    width[1] = kTailFrom;
    for (std::size_t i = 2; i < kLayers; ++i) {
      width[i] = std::sqrt(-2 * std::log(kArea / width[i - 1] + height));
      height = std::exp(-0.5 * width[i] * width[i]);
    }
    width[kLayers] = 0;
    for (std::size_t i = 0; i < kLayers; ++i) inside[i] = width[i + 1] / width[i];
  }
};

const Ziggurat& ziggurat() {
  static const Ziggurat kZiggurat;
  return kZiggurat;
}

/// Draws from the tail beyond kTailFrom (Marsaglia 1964).
double tail(std::mt19937_64& engine) {
  while (true) {
    // 1 - u is never 0, so its logarithm is finite.
    const double x = std::log(1 - uniform(engine)) / Ziggurat::kTailFrom;
    const double y = std::log(1 - uniform(engine));
    if (-2 * y >= x * x) return Ziggurat::kTailFrom - x;
  }
}

double draw(const Ziggurat& table, std::mt19937_64& engine) {
  while (true) {
    const std::uint64_t bits = engine();
    const std::size_t layer = bits % Ziggurat::kLayers;                                     // the low 7 bits,
    const double u = static_cast<double>(static_cast<std::int64_t>(bits) >> 11) * 0x1p-52;  // and 53 others: -1 to 1
    const double x = u * table.width[layer];
    if (std::abs(u) < table.inside[layer]) return x;
    if (layer == 0) return std::copysign(tail(engine), u);
    const auto relative_height = [&](double width) { return std::exp(-0.5 * (width * width - x * x)); };
    const double low = relative_height(table.width[layer]);
    const double high = relative_height(table.width[layer + 1]);
    if (low + uniform(engine) * (high - low) < 1) return x;
  }
}

}  // namespace

std::mt19937_64 camera_engine(std::uint64_t seed, CameraPurpose purpose, std::string_view camera, std::uint64_t step) {
  const std::uint64_t name = hash(camera);
  const auto low = [](std::uint64_t value) { return static_cast<std::uint32_t>(value & 0xffffffffU); };
  const auto high = [](std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); };
  std::seed_seq words{low(seed), high(seed), static_cast<std::uint32_t>(purpose), low(name), high(name),
                      low(step), high(step)};
  return std::mt19937_64(words);
}

double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1p-53; }

double Normal::operator()() { return draw(ziggurat(), engine_); }

void add_shot_noise(Light& light, double full_well_electrons, Normal normal) {
  const auto one_electron = static_cast<float>(full_well_electrons > 0 ? 1 / full_well_electrons : 0);
  for (float& value : light.values) {
    value += std::sqrt(std::max(value, 0.0F) * one_electron) * static_cast<float>(normal());
  }
}

void add_read_noise(Light& light, double sigma, Normal normal) {
  const auto scale = static_cast<float>(sigma);
  for (std::size_t i = 0; i + 2 < light.values.size(); i += 3) {
    float* const pixel = light.values.data() + i;
    const bool is_rendered = pixel[0] != 0 || pixel[1] != 0 || pixel[2] != 0;
    for (int channel = 0; channel < 3; ++channel) {
      // Drawn in any case, so that no pixel's noise depends on another's light.
      const float noise = scale * static_cast<float>(normal());
      if (is_rendered) pixel[channel] += noise;
    }
  }
}

}  // namespace twocone::sim_povray
