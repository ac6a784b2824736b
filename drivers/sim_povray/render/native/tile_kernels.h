// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "drivers/sim_povray/render/native/ray.h"
#include "drivers/sim_povray/scene/vector3.h"

/// The loops over rays that take most of the time, for the widest instructions of the processor (Highway). Each result
/// comes from the same operations in the same order on all processors, so that images do not depend on them.
namespace twocone::sim_povray {

/// Rays of a tile: neighbouring pixels, 8 x 8.
constexpr int kTileRays = 64;
using Lane = std::array<double, kTileRays>;

struct alignas(64) TileVectors {
  Lane x, y, z;

  [[nodiscard]] Vec3 at(int i) const { return {x[std::size_t(i)], y[std::size_t(i)], z[std::size_t(i)]}; }
  void set(int i, const Vec3& v) {
    x[std::size_t(i)] = v.x;
    y[std::size_t(i)] = v.y;
    z[std::size_t(i)] = v.z;
  }
};

/// Lanes that are not in use repeat one that is.
struct alignas(64) RayTile {
  TileVectors origin, direction, inverse;  ///< inverse: 1 / direction, finite
};

struct alignas(64) TileHits {
  Lane t;       ///< of the nearest surface so far
  Lane number;  ///< of its item; -1: none
};

/// Sets the images of rays, and their inverse directions as invert_directions() does.
void transform_rays(const Transform& transform, const TileVectors& origin, const TileVectors& direction,
                    RayTile& result);
/// Sets `inverse`. A component that is nearly 0 counts as 1e-300, so that no product is NaN.
void invert_directions(RayTile& rays);
/// Returns the greatest of the numbers.
double greatest_of(const Lane& lane);
/// Smallest and greatest component over all lanes.
Bounds3 limits_of(const TileVectors& vectors);

/// Notes the box where it is nearer than what `hits` has (at the same distance: if its number is lower) and not nearer
/// than `t_min`.
void meet_box(const RayTile& rays, const Bounds3& box, double number, double t_min, TileHits& hits);
/// Returns the lanes, as bits, whose rays pass through the box between t_min and their t.
std::uint64_t lanes_through(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t);
/// Returns the lanes whose rays cross a face of the box between their t_min and their t.
std::uint64_t lanes_blocked(const RayTile& rays, const Bounds3& box, const Lane& t_min, const Lane& t);
/// Directs rays, which have their origins, to a light: sets directions of length 1 and their inverse, `distance` to the
/// light and `cosine` between direction and normal (of length 1).
void aim_at_light(const Vec3& light, const TileVectors& normals, RayTile& rays, Lane& distance, Lane& cosine);

/// Returns the name of the instruction set in use: "AVX2".
std::string instruction_set();

}  // namespace twocone::sim_povray
