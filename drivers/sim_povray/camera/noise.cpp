// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/hash.h"

namespace twocone::sim_povray {

std::mt19937_64 camera_engine(std::uint64_t seed, CameraPurpose purpose, std::string_view camera, std::uint64_t step) {
  const std::uint64_t name = base::fnv1a(camera);
  const auto low = [](std::uint64_t value) { return static_cast<std::uint32_t>(value & 0xffffffffU); };
  const auto high = [](std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); };
  std::seed_seq words{low(seed), high(seed), static_cast<std::uint32_t>(purpose), low(name), high(name),
                      low(step), high(step)};
  return std::mt19937_64(words);
}

double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1p-53; }

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
