// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/scene/evaluated_scene.h"
#include "drivers/sim_povray/scene/vector3.h"

/// The colours of surfaces, found from POV-Ray's documentation and from the numbers and images that POV-Ray 3.7.0.10
/// gives. Every function is free of state and may be called from any thread.
namespace twocone::sim_povray {

/// Returns the colour of a pigment that is not a plain colour, as pigment_colour().
Colour patterned_colour(const Pigment& pigment, const Vec3& point);

/// Returns the colour of `pigment` at a point given in the coordinates around the pigment.
inline Colour pigment_colour(const Pigment& pigment, const Vec3& point) {
  if (pigment.pattern != Pattern::kColour) return patterned_colour(pigment, point);
  return pigment.entries.empty() ? Colour{} : pigment.entries.front().colour;
}

/// Returns the number from 0 to 1 by which `pigment`, which must not be a plain colour, looks a colour up: POV-Ray's
/// `function { pattern { ... } }`. For a checker it is 0 or 1, for a brick 0 in the mortar and else 1.
double pattern_value(const Pigment& pigment, const Vec3& point);

}  // namespace twocone::sim_povray
