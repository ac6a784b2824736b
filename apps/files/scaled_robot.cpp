// SPDX-License-Identifier: Apache-2.0
#include "apps/files/scaled_robot.h"

#include <cmath>

namespace twocone::files {
namespace {

/// Where a pixel's coordinate lies in a picture scaled by `k`.
double scaled_px(double place_px, double k) { return (place_px + 0.5) * k - 0.5; }

void scale(CameraEntry& camera, RigView& view, double k) {
  camera.width_px = static_cast<int>(std::lround(camera.width_px * k));
  camera.height_px = static_cast<int>(std::lround(camera.height_px * k));
  for (double& place_px : view.centre_px) place_px = scaled_px(place_px, k);
  view.rim_radius_px *= k;
  if (view.distortion_focal_px) {
    for (double& focal_px : *view.distortion_focal_px) focal_px *= k;
  }
  if (view.distortion_principal_px) {
    for (double& place_px : *view.distortion_principal_px) place_px = scaled_px(place_px, k);
  }
  // These are pixels of the simulated camera's picture.
  camera.effects.distortion_focal_px *= k;
  camera.effects.defocus_px *= k;
}

}  // namespace

Robot scaled(Robot robot, double k) {
  scale(robot.lower, robot.rig.lower, k);
  scale(robot.upper, robot.rig.upper, k);
  return robot;
}

}  // namespace twocone::files
