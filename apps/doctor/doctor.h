// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "apps/doctor/report.h"
#include "apps/doctor/surroundings.h"
#include "apps/files/robot_file.h"
#include "drivers/backends.h"

/// A robot part by part, as on a bench: does each do what the robot file says of it?
namespace twocone::doctor {

struct Options {
  double seconds = 3;                  ///< of measuring, for each camera and for the pair, > 0
  bool wheels_off_the_ground = false;  ///< said by the person: the wheels may be turned without asking
};

/// How parts are opened; a test brings its own.
struct Openers {
  std::function<Result<std::unique_ptr<Camera>>(const std::string& part, const drivers::CameraPart&)> camera =
      drivers::open_camera;
  std::function<Result<std::unique_ptr<DiffDrive>>(const drivers::DrivePart&)> drive = drivers::open_drive;
  std::function<Result<Robot>(const drivers::RobotSettings&)> robot = drivers::open_robot;
};

/// Files, each camera, the pair, the drive, and, with a person's word that they are off the ground, the wheels. Parts
/// without a device (sim_povray, memory) are not tested by themselves; a robot of such parts only is opened, started
/// and asked for a pair. A trouble of the world is a row, not an exception. Wheels and cameras rest afterwards, also
/// where `surroundings.stop` ends it early, which is a failed row.
Report examine(const files::Robot& robot, const Options& options, const Openers& openers,
               const Surroundings& surroundings);

}  // namespace twocone::doctor
