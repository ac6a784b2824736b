// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "drivers/sim_povray/render/native/tile_kernels.h"
#include "drivers/sim_povray/render/native/traced_scene.h"

namespace twocone::sim_povray {

/// Neighbouring rays that are traced together.
struct RayBundle {
  RayTile rays;            ///< in the scene's coordinates; directions of length 1
  std::uint64_t used = 0;  ///< which lanes count; the others repeat one of them
  Lane t_max;              ///< surfaces are looked for nearer than this
};

/// What each lane of a bundle sees.
struct SeenTile {
  std::uint64_t met = 0;  ///< lanes that met a surface; `colours` holds only these
  std::array<Colour, kTileRays> colours;
};

/// Traces reflected rays, of level 2, against the groups in `which`; shadows come from all groups. The colours are
/// those of nearest() and shaded(), to the last bit.
/// @param weight of what the rays bring, per lane
void trace_tile(const TracedScene& scene, const Poses& poses, const RayBundle& bundle, GroupSet which,
                const std::array<double, kTileRays>& weights, SeenTile& seen);

}  // namespace twocone::sim_povray
