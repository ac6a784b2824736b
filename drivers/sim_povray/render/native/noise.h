// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "drivers/sim_povray/scene/vector3.h"

/// The random but smooth functions of space behind POV-Ray's patterns, found from the numbers that POV-Ray 3.7.0.10
/// prints. Every function is free of state and may be called from any thread. Coordinates lie within +-2e9.
namespace twocone::sim_povray {

/// POV-Ray's `f_noise3d` with noise generator 2, the default of `#version 3.7`. @return from 0 to 1
double noise(const Vec3& p);

/// The noise that displaces points: each component has the mean 0 and about the range of +-1.
Vec3 vector_noise(const Vec3& p);

/// POV-Ray's `vturbulence(lambda, omega, octaves, p)`. Does not use the turbulence's amount.
Vec3 turbulence(const Vec3& p, const Turbulence& turbulence);

}  // namespace twocone::sim_povray
