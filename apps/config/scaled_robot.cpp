// SPDX-License-Identifier: Apache-2.0
#include "apps/config/scaled_robot.h"

#include <cmath>

namespace twocone::config {
namespace {

/// Returns the coordinate of a pixel in an image that is scaled by `k`.
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
  // These values are in pixels of the simulated camera's image.
  camera.effects.distortion_focal_px *= k;
  camera.effects.defocus_px *= k;
}

}  // namespace

Robot scaled(Robot robot, double k) {
  scale(robot.lower, robot.rig.lower, k);
  scale(robot.upper, robot.rig.upper, k);
  return robot;
}

}  // namespace twocone::config
