// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "drivers/sim_povray/scene/vector3.h"

/// How surfaces are lit, found from POV-Ray's documentation and from 16-bit images that POV-Ray 3.7.0.10 renders: every
/// function here agrees with them to their last digit. Directions have length 1.
namespace twocone::sim_povray {

/// Returns how much of a light's colour reaches a point, by its cone and its fading.
double share_at(const LightSource& light, const Vec3& point);

/// Returns whether the same light reaches all points.
inline bool is_even_light(const LightSource& light) {
  return !light.is_spot && (light.fade_distance == 0 || light.fade_power <= 0);
}

/// Returns the light that reaches a point if nothing is in the way: the source's colour, cone and fading.
inline Colour light_at(const LightSource& light, const Vec3& point) {
  return is_even_light(light) ? light.colour : light.colour * share_at(light, point);
}

/// Returns whether light sources change what a surface shows.
inline bool shows_light(const Finish& finish) { return finish.diffuse != 0 || finish.phong > 0 || finish.specular > 0; }

/// Returns what a surface shows without any light source.
inline Colour unlit(const Finish& finish, const Colour& pigment, const Colour& ambient_light) {
  return pigment * (finish.ambient * ambient_light + finish.emission);
}

/// Returns the highlights of a surface. `metallic` gives them the surface's colour where the light does not graze it.
/// Source: POV-Ray's documentation; the share that stays white at each angle was measured (shading.cpp).
/// @param normal on the eye's and the light's side
Colour highlight_of(const Finish& finish, const Colour& pigment, const Vec3& normal, const Vec3& to_eye,
                    const Vec3& to_light);

/// Returns what a surface adds for one light source.
/// @param normal on the eye's side @param light what light_at() returns @param with_highlights not of a shadowless
/// light
inline Colour lit(const Finish& finish, const Colour& pigment, const Vec3& normal, const Vec3& to_eye,
                  const Vec3& to_light, const Colour& light, bool with_highlights) {
  const double cosine = dot(normal, to_light);
  if (!(cosine > 0)) return {};
  Colour result = pigment * (finish.diffuse * (finish.brilliance == 1 ? cosine : std::pow(cosine, finish.brilliance)));
  if (with_highlights && (finish.phong > 0 || finish.specular > 0)) {
    result += highlight_of(finish, pigment, normal, to_eye, to_light);
  }
  return result * light;
}

}  // namespace twocone::sim_povray
