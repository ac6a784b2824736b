// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/sim_povray/scene/vector3.h"

namespace twocone::sim_povray {

/// The points origin + t direction. The direction is not zero and may be of any length; t is in its units.
struct Ray {
  Vec3 origin, direction;

  [[nodiscard]] Vec3 at(double t) const { return origin + direction * t; }
};

/// Returns a normal on the side that a ray of this direction comes from.
inline Vec3 against(const Vec3& normal, const Vec3& direction) { return dot(normal, direction) > 0 ? -normal : normal; }

/// A box along the axes.
struct Bounds3 {
  Vec3 low, high;

  friend bool operator==(const Bounds3&, const Bounds3&) = default;
};
constexpr bool is_within(const Vec3& p, const Bounds3& box) {
  return p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y && p.z >= box.low.z &&
         p.z <= box.high.z;
}
/// Returns the smallest box around both.
constexpr Bounds3 around(const Bounds3& a, const Bounds3& b) { return {lowest(a.low, b.low), highest(a.high, b.high)}; }

/// Where a line crosses a surface of the second degree, in order; `count` is 0, 1 or 2.
struct Roots {
  int count = 0;
  double first = 0;
  double second = 0;
};

/// Solves a s^2 + 2 b s + c = 0 without cancellation.
Roots solve_quadratic(double a, double b, double c);

/// Where a line crosses a torus, in no particular order. Unused entries are 0.
struct TorusCrossings {
  int count = 0;
  double at[4] = {};
};

/// Crosses a torus about the y axis, in the plane y = 0.
/// @param nearest the line's point nearest to the origin: at right angles to `direction`, where s = 0
/// @param direction of length 1
TorusCrossings cross_torus(const Vec3& nearest, const Vec3& direction, double major_radius, double minor_radius);

}  // namespace twocone::sim_povray
