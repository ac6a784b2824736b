// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/config/robot_file.h"

namespace twocone::testing_support {

/// Returns a robot with the lab's mirrors: v s = 212400 px mm, d = 120 mm. All of its parts use that driver.
inline config::Robot lab_robot(const std::string& driver = "sim_povray") {
  config::Robot robot;
  robot.file = "lab.yaml";
  robot.body_radius_m = 0.2;
  robot.drive = {driver, 0.30, 0.05, 0.5, 0.5};
  robot.lower = robot.upper = {driver, 640, 480, 15, 1};
  config::RigView view;
  view.mirror_radius_m = 0.06;
  view.lens_to_tip_m = 0.12;
  view.centre_px = {319.5, 239.5};
  view.rim_radius_px = 236;
  robot.rig.lower = robot.rig.upper = view;
  robot.rig.mirror_separation_m = 0.30;
  robot.rig.sigma.emplace();  // exact by construction
  robot.drive.sigma.emplace();
  robot.rig.lens_height_m = 0.25;
  return robot;
}

/// Returns the robot with images of another size, in which both mirrors' images are central with that radius.
inline config::Robot with_images(config::Robot robot, int width_px, int height_px, double rim_radius_px) {
  for (drivers::CameraPart* const camera : {&robot.lower, &robot.upper}) {
    camera->settings.width_px = width_px;
    camera->settings.height_px = height_px;
  }
  for (config::RigView* const view : {&robot.rig.lower, &robot.rig.upper}) {
    view->centre_px = {(width_px - 1) / 2.0, (height_px - 1) / 2.0};
    view->rim_radius_px = rim_radius_px;
  }
  return robot;
}

}  // namespace twocone::testing_support
