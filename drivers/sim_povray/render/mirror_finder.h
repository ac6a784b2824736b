// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/render/povray.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {

/// Where a view shows its mirror, as the scene has it. It rides with the camera, so it is the same in every picture.
struct MirrorSight {
  /// The mirror's circle in the picture, to the edge of the outermost pixel that shows it: without the margin.
  double centre_column_px = 0;
  double centre_row_px = 0;
  double radius_px = 0;
  /// What has to be rendered: the circle with kRimMargin_px and kMaskTeeth_px (camera_mask.h), cut by the picture.
  Window window;
  /// An object that hides from the camera, and from nothing else, what is outside that circle; placed for the camera as
  /// the scene shows it. Empty where it cannot be placed: `why_no_mask` says why.
  std::string mask;
  std::string why_no_mask;
};

/// Pixels beyond the rim that are still rendered: the rim finder and eyes need its surroundings.
constexpr double kRimMargin_px = 6;

/// Finds the mirror with the help of POV-Ray alone: which pixels reflect. Nothing where the view has no mirror.
/// Takes two short renderings (about a second); gives up when `stop_fd` gets readable (-1: never).
/// Errors: those of Povray::render.
Result<std::optional<MirrorSight>> find_mirror(const Povray& povray, const Scene& scene, const NamedBlock& robot,
                                               const NamedBlock& camera, int width_px, int height_px, int stop_fd);

}  // namespace twocone::sim_povray
