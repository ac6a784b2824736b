// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "drivers/sim_povray/render/circle.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene.h"
#include "hal/result.h"

namespace twocone::sim_povray {

/// The place where a view shows its mirror. The mirror moves with the camera, so it is the same in every image.
struct MirrorSight {
  Circle circle;  ///< of the mirror, to the edge of the outermost pixel that shows it: without the margin
  /// Pixels that must be rendered: the circle with kRimMargin_px and kMaskTeeth_px, cut by the image.
  Window window;
  /// An object that hides from the camera, and from nothing else, the image outside that circle; placed for the camera
  /// as the scene shows it. Empty if it cannot be placed: camera_mask() refuses, or it would hide something else.
  std::string mask;
};

/// Pixels beyond the rim that are still rendered: the rim finder and people need the rim's surroundings.
constexpr double kRimMargin_px = 6;
/// Depth of the teeth of a mask's edge, camera_mask().
constexpr double kMaskTeeth_px = 8;

/// Finds the mirror with the help of POV-Ray alone, by the pixels that reflect. Returns nothing if the view has no
/// mirror. Takes up to four short renderings (about a second); ends early when `stop_fd` becomes readable (-1: never).
/// Errors: those of Povray::render.
Result<std::optional<MirrorSight>> find_mirror(const Povray& povray, const Scene& scene, const NamedBlock& robot,
                                               const NamedBlock& camera, int width_px, int height_px, int stop_fd);

/// The parts of a camera statement, as scene text for the position of that statement.
struct CameraVectors {
  /// Declares PREFIX followed by Location, Direction, Right and Up (Scene::prefix), before the transformations.
  std::string declarations;
  std::string transformations;
};
/// Takes a camera statement apart. Errors: kRefused, with the reason: the camera is of another kind, takes its vectors
/// from another camera, blurs, or its statement holds a directive.
Result<CameraVectors> camera_vectors(const Scene& scene, const NamedBlock& camera);

/// Returns an object, as one line for Scene::view_template, that hides from a camera the part of its image outside a
/// circle, and is seen by nothing else: a black pane with a hole, close in front of the camera. The edge of the hole is
/// jagged: it alternates between the circle and one that is kMaskTeeth_px larger. No circle therefore lies along more
/// than a quarter of it, and it is not taken for a mirror's rim. POV-Ray itself computes the camera's vectors, by the
/// rules of POV-Ray 3.5 and later for a camera statement (the order of its parts does not matter; `angle` sets the
/// length of `direction`; `look_at` turns all three; then come the transformations).
///
/// Errors: kRefused: as camera_vectors(); or the circle leaves nothing to hide.
Result<std::string> camera_mask(const Scene& scene, const NamedBlock& camera, const Circle& circle, int width_px,
                                int height_px);

}  // namespace twocone::sim_povray
