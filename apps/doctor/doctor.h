// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/config/robot_file.h"
#include "apps/doctor/report.h"
#include "drivers/backends.h"
#include "hal/clock.h"

/// Examines a robot part by part, and reports whether each part behaves as the robot file states.
namespace twocone::doctor {

/// Everything that the doctor needs in addition to the devices. The caller provides it, so a test can control time and
/// user.
struct Surroundings {
  const Clock& clock;
  std::function<void(std::chrono::nanoseconds)> sleep;
  /// Asks the user a question and waits, perhaps for minutes. Returns nothing without an answer. Empty: no user.
  std::function<std::optional<std::string>(const std::string& question)> ask{};
  /// Called with the current work and its fraction done, 0 to 1.
  std::function<void(const std::string& what, double share)> progress = [](const std::string&, double) {};
  /// Set from outside: wheels and cameras are then stopped, and the report ends.
  const std::atomic<bool>& stop;

  [[nodiscard]] double now_s() const { return clock.now().seconds(); }
};

struct Options {
  double seconds = 3;  ///< duration of a measurement, for each camera and for the pair, > 0
  /// Folder for one image of each camera with circles on rim and tip; it is made if necessary. Empty: none are stored.
  std::filesystem::path images{};
  bool wheels_off_the_ground = false;  ///< stated by the user: the wheels may be turned without a question
};

/// The functions that open parts; a test replaces them.
struct Openers {
  std::function<Result<std::unique_ptr<Camera>>(const std::string& part, const drivers::CameraPart&)> camera =
      drivers::open_camera;
  std::function<Result<std::unique_ptr<DiffDrive>>(const drivers::DrivePart&)> drive = drivers::open_drive;
  std::function<Result<Robot>(const drivers::RobotSettings&)> robot = drivers::open_robot;
};

/// Checks the files, each camera, the pair and the drive. Tests the wheels only if the user confirms that they are off
/// the ground. Parts without a device (sim_povray, memory) are not tested one by one. If all parts are of this kind,
/// the robot is opened and started, and one pair is taken. A failure of a device or a file adds a row and throws
/// nothing. Wheels and cameras are stopped at the end. If `surroundings.stop` ends the examination early, they are
/// stopped too, and a failed row reports it.
Report examine(const config::Robot& robot, const Options& options, const Openers& openers,
               const Surroundings& surroundings);

}  // namespace twocone::doctor
