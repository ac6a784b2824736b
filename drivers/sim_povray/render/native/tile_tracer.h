// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "drivers/sim_povray/render/native/tile_kernels.h"
#include "drivers/sim_povray/render/native/traced_scene.h"

namespace twocone::sim_povray {

/// Calls `visit(lane)` for each set bit.
template <class Visit>
void for_each_lane(std::uint64_t lanes, Visit visit) {
  for (; lanes != 0; lanes &= lanes - 1) visit(std::countr_zero(lanes));
}

/// Neighbouring rays that are traced together.
struct RayBundle {
  RayTile rays;            ///< in the scene's coordinates; directions of length 1
  std::uint64_t used = 0;  ///< which lanes count; the others repeat one of them
  Lane t_max;              ///< surfaces are looked for nearer than this
};

/// Completes a bundle of which the rays of the lanes in use are set; at least one is.
void fill_unused(RayBundle& bundle);

/// What each lane of a bundle sees.
struct SeenTile {
  TileVectors colours;    ///< in linear light, of the lanes in use
  std::uint64_t met = 0;  ///< lanes that met a surface; the others see the sky
  /// What the lanes in `met` meet, until this thread traces rays of the same level again.
  const TileHits* hits = nullptr;
  const TileVectors* normals = nullptr;  ///< of length 1, on the side that is seen
  const std::array<const Texture*, kTileRays>* textures = nullptr;
  std::uint64_t mirrored = 0;           ///< lanes whose ray is followed beyond a reflecting surface,
  const SeenTile* reflected = nullptr;  ///< and what they see there
};

/// Finds what each lane of a bundle sees: the nearest surface of the groups in `which`, and its light.
/// @param level of the rays: 1 from the camera, then one more for each reflection @param weights of what they bring
void trace_tile(const PosedScene& posed, const RayBundle& bundle, int level, GroupSet which, const Lane& weights,
                SeenTile& seen);

}  // namespace twocone::sim_povray
