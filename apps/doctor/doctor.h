// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "apps/config/robot_file.h"
#include "apps/doctor/report.h"
#include "apps/doctor/surroundings.h"
#include "drivers/backends.h"

/// Examines a robot part by part, as on a bench: does each part behave as the robot file states?
namespace twocone::doctor {

struct Options {
  double seconds = 3;                  ///< duration of a measurement, for each camera and for the pair, > 0
  bool wheels_off_the_ground = false;  ///< the user has stated it: the wheels may be turned without a question
};

/// The functions that open parts; a test replaces them.
struct Openers {
  std::function<Result<std::unique_ptr<Camera>>(const std::string& part, const drivers::CameraPart&)> camera =
      drivers::open_camera;
  std::function<Result<std::unique_ptr<DiffDrive>>(const drivers::DrivePart&)> drive = drivers::open_drive;
  std::function<Result<Robot>(const drivers::RobotSettings&)> robot = drivers::open_robot;
};

/// Checks the files, each camera, the pair, the drive, and, if the user confirms that they are off the ground, the
/// wheels. Parts without a device (sim_povray, memory) are not tested one by one: a robot that consists of such parts
/// is opened, started, and one pair is taken. A failure of a device or a file is a row, not an exception. Wheels and
/// cameras are stopped afterwards, also where `surroundings.stop` ends the examination early, which is a failed row.
Report examine(const config::Robot& robot, const Options& options, const Openers& openers,
               const Surroundings& surroundings);

}  // namespace twocone::doctor
