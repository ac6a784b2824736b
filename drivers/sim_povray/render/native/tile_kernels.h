// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
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
/// A direction's component that is nearer to 0 counts as this, so that no product with its inverse is NaN.
constexpr double kLeastComponent = 1e-300;
/// Returns 1 / direction.
inline double inverse_of(double direction) {
  return 1 / (std::abs(direction) < kLeastComponent ? kLeastComponent : direction);
}
/// Sets `inverse` to inverse_of() the directions.
void invert_directions(RayTile& rays);
/// Returns the greatest of the numbers.
double greatest_of(const Lane& lane);
/// Smallest and greatest component over all lanes.
Bounds3 limits_of(const TileVectors& vectors);
/// Returns the lanes, as bits, that hold this number.
std::uint64_t lanes_with(const Lane& lane, double number);

/// Notes the box where it is nearer than what `hits` has (at the same distance: if its number is lower) and not nearer
/// than `t_min`.
void meet_box(const RayTile& rays, const Bounds3& box, double number, double t_min, TileHits& hits);
/// Returns the lanes whose rays pass through the box between t_min and their t.
std::uint64_t lanes_through(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t);
/// Returns the lanes whose rays cross a face of the box between t_min and their t.
std::uint64_t lanes_blocked(const RayTile& rays, const Bounds3& box, double t_min, const Lane& t);

/// Sets points[i] to where ray i is at t[i].
void points_along(const RayTile& rays, const Lane& t, TileVectors& points);
/// Sets the normals of a box where meet_box() found it, on the side that the rays come from, in these lanes.
void box_normals(const RayTile& rays, const Bounds3& box, const Lane& t, std::uint64_t lanes, TileVectors& normals);

/// Surfaces as light sources light them.
struct alignas(64) TileSurfaces {
  TileVectors normals;  ///< of length 1, on the side that is seen
  TileVectors pigments;
  Lane diffuse;  ///< Finish::diffuse
};
/// Directs rays, which have their origins, to a light: sets directions of length 1, their inverse, `t_max`, which is
/// the distance to the light less `margin`, and `cosine` between direction and normal. Returns the lanes that face the
/// light.
std::uint64_t aim_at_light(const Vec3& light, const TileVectors& normals, double margin, RayTile& rays, Lane& t_max,
                           Lane& cosine);
/// Sets the vectors of some lanes to `value`.
void fill(std::uint64_t lanes, const Vec3& value, TileVectors& vectors);
/// Adds to the colours of some lanes what their surfaces scatter of a light: pigment (diffuse cosine) light.
void add_diffuse(std::uint64_t lanes, const TileSurfaces& surfaces, const Lane& cosine, const Vec3& light,
                 TileVectors& colours);
/// Sets the colours of some lanes to base + share seen.
void mix(std::uint64_t lanes, const Vec3& base, const Vec3& share, const TileVectors& seen, TileVectors& colours);
/// The bytes of a tile's pixels: red, green and blue of the first, and so on.
using TileBytes = std::array<std::uint8_t, std::size_t{3} * kTileRays>;
/// Sets the bytes of an image file (`File_Gamma=sRGB`) for the colours.
/// Source: IEC 61966-2-1, and the nearest byte.
void srgb_bytes(const TileVectors& colours, TileBytes& bytes);

/// Returns the name of the instruction set in use: "AVX2".
std::string instruction_set();

}  // namespace twocone::sim_povray
