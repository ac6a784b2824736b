// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "drivers/sim_povray/robot_body.h"
#include "hal/diff_drive.h"
#include "hal/image.h"

namespace twocone::sim_povray {

/// Resources that POV-Ray used for one rendered image.
struct RenderedImage {
  std::string camera;               ///< its ViewSettings::camera_name
  std::uint64_t step = 0;           ///< number of the image's step
  std::chrono::nanoseconds cpu{0};  ///< processor time of all threads; the first image of a process includes its start
  std::uint64_t peak_bytes = 0;     ///< peak memory of its process so far; 0: unknown
};

/// A robot that joins a world.
struct SessionSettings {
  /// The robot's name in the scene. It selects the object `robot.NAME` with the cameras `VIEW.NAME` or, if the scene
  /// has no such object, `robot` with the cameras `VIEW`.
  std::string name;
  RobotBody body;  ///< the claimed object's name replaces its name
  DriveLimits drive;
  /// Outline of the place according to the robot's map, as outline_of() writes it. A world with a different outline
  /// refuses the robot. Empty: unknown.
  std::string map_outline{};
  int run_ahead_frames = 6;  ///< steps whose images may be unfinished before a grab waits, >= 1
  /// Called from any thread after each image is rendered (several times for an image that is averaged from shutter
  /// samples), before the frame is ready. Must neither block nor throw, and may be called after the robot has left. Not
  /// called for the renderings that locate a mirror, for images of a world that another program serves, or where the
  /// system does not report the use.
  std::function<void(const RenderedImage&)> rendered{};
  /// Returns the finished image that a camera (by ViewSettings::camera_name) took at a step of an equal world before.
  /// The camera then hands out this image and renders none. Null: there is none. Called by grab().
  std::function<std::shared_ptr<const Image>(const std::string& camera, std::uint64_t step)> stored{};
};

/// @throws std::invalid_argument naming every bad field
void check(const SessionSettings& settings);

}  // namespace twocone::sim_povray
