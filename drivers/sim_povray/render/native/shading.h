// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "drivers/sim_povray/scene/vector3.h"

/// How surfaces are lit, found from POV-Ray's documentation and from 16-bit images that POV-Ray 3.7.0.10 renders: every
/// function here agrees with them to their last digit. Directions have length 1.
namespace twocone::sim_povray {

/// Returns the light that reaches a point if nothing is in the way: the source's colour, cone and fading.
Colour light_at(const LightSource& light, const Vec3& point);

/// Returns what a surface shows without any light source.
Colour unlit(const Finish& finish, const Colour& pigment, const Colour& ambient_light);

/// Returns what a surface adds for one light source.
/// @param normal on the eye's side @param light what light_at() returns
Colour lit(const Finish& finish, const Colour& pigment, const Vec3& normal, const Vec3& to_eye, const Vec3& to_light,
           const Colour& light);

/// Returns the byte of an image file (`File_Gamma=sRGB`) for a component of a colour.
/// Source: IEC 61966-2-1, and the nearest byte.
std::uint8_t srgb_byte(double linear);

}  // namespace twocone::sim_povray
