// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "drivers/sim_povray/render/circle.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {

/// Where a view shows its mirror. The mirror moves with the camera, so it is the same in every image.
struct MirrorSight {
  Circle circle;  ///< of the mirror, to the edge of the outermost pixel that shows it: without the margin
  /// Pixels that must be rendered: the circle with kRimMargin_px and kMaskTeeth_px (camera_mask.h), cut by the image.
  Window window;
  /// An object that hides from the camera, and from nothing else, the image outside that circle; placed for the camera
  /// as the scene shows it. Empty if it cannot be placed: camera_mask() refuses, or it would hide something else.
  std::string mask;
};

/// Pixels beyond the rim that are still rendered: the rim finder and people need the rim's surroundings.
constexpr double kRimMargin_px = 6;

/// Finds the mirror with the help of POV-Ray alone, by the pixels that reflect. Returns nothing if the view has no
/// mirror. Takes two short renderings (about a second); ends early when `stop_fd` becomes readable (-1: never).
/// Errors: those of Povray::render.
Result<std::optional<MirrorSight>> find_mirror(const Povray& povray, const Scene& scene, const NamedBlock& robot,
                                               const NamedBlock& camera, int width_px, int height_px, int stop_fd);

}  // namespace twocone::sim_povray
