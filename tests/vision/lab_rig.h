// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "vision/mirror_view.h"

namespace twocone::vision {

/// A view with the lab's mirror sizes (robots/lab_sim.yaml).
inline MirrorViewSettings lab_view(double lens_height_m) {
  return {.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12},
          .lens_height_m = lens_height_m,
          .centre_px = {319.5, 239.5},
          .rim_radius_px = 236};
}
inline Rig lab_rig() { return {MirrorView(lab_view(0.25)), MirrorView(lab_view(0.55))}; }

}  // namespace twocone::vision
