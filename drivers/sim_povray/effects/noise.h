// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <string_view>

#include "drivers/sim_povray/effects/light.h"

/// The random numbers of a camera. One generator for each purpose, camera and picture, so that what one draws never
/// depends on another.
namespace twocone::sim_povray {

/// What a camera's random engines are for. The numbers are part of every result's seed: never reuse one. Those of the
/// world's own engines are below 101.
enum class CameraPurpose : std::uint32_t { kShotNoise = 101, kReadNoise = 102, kDrop = 103, kLate = 104 };

[[nodiscard]] std::mt19937_64 camera_engine(std::uint64_t seed, CameraPurpose purpose, std::string_view camera,
                                            std::uint64_t tick);

/// In [0, 1), of 53 random bits.
[[nodiscard]] double uniform(std::mt19937_64& engine);

/// Standard normal deviates, exact but for rounding and the same with every standard library, which
/// std::normal_distribution is not (libstdc++'s also takes twice as long): the ziggurat of Marsaglia and Tsang (2000)
/// as Doornik (2005) corrected it, 128 layers.
class Normal {
 public:
  explicit Normal(std::mt19937_64 engine) : engine_(engine) {}
  double operator()();

 private:
  std::mt19937_64 engine_;
};

/// light + sqrt(light / full_well) z: Poisson's variance of light * full_well electrons. Draws one z for each value
/// whatever the value is. @param full_well_electrons 0: endlessly many, no noise
void add_shot_noise(Light& light, double full_well_electrons, Normal normal);
/// light + sigma z, but for pixels without any light, which stay so: those are the ones beside the mirror that are not
/// rendered, and programs know by their black that nothing was recorded there. @param sigma of full scale
void add_read_noise(Light& light, double sigma, Normal normal);

}  // namespace twocone::sim_povray
