// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <string_view>

#include <boost/random/normal_distribution.hpp>

#include "drivers/sim_povray/camera/light.h"

/// Random numbers of a camera. Each purpose, camera and image has a generator of its own, so that its draws never
/// depend on the others'.
namespace twocone::sim_povray {

/// Purposes of a camera's random engines. The numbers are part of every result's seed: never reuse one. The numbers of
/// the world's own engines are below 101.
enum class CameraPurpose : std::uint32_t { kShotNoise = 101, kReadNoise = 102, kDrop = 103, kLate = 104 };

[[nodiscard]] std::mt19937_64 camera_engine(std::uint64_t seed, CameraPurpose purpose, std::string_view camera,
                                            std::uint64_t step);

/// Returns a number in [0, 1), made of 53 random bits.
[[nodiscard]] double uniform(std::mt19937_64& engine);

/// Standard normal deviates, identical with every standard library, unlike std::normal_distribution (libstdc++'s also
/// takes twice as long as a ziggurat). Boost's distribution is a ziggurat with constant tables.
class Normal {
 public:
  explicit Normal(std::mt19937_64 engine) : engine_(engine) {}
  double operator()() { return distribution_(engine_); }

 private:
  std::mt19937_64 engine_;
  boost::random::normal_distribution<double> distribution_;
};

/// Changes light to light + sqrt(light / full_well) z: Poisson's variance of light * full_well electrons. Draws one z
/// for each value, whatever the value is. @param full_well_electrons 0: infinitely many, no noise
void add_shot_noise(Light& light, double full_well_electrons, Normal normal);
/// Changes light to light + sigma z, except for pixels without any light. Those are the pixels beside the mirror that
/// are not rendered; programs recognise by their black that nothing was recorded there. @param sigma of full scale
void add_read_noise(Light& light, double sigma, Normal normal);

}  // namespace twocone::sim_povray
