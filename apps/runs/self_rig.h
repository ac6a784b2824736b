// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>
#include <string>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runs/run.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone::runs {

/// A robot whose rig is that of its first images.
struct SelfRigRobot {
  config::Robot robot;  ///< its `changes` hold what was found, so that run.yaml and localise repeat it
  std::string event;    ///< what was taken from the images, in one line
};

/// Opens the robot, takes one pair of images at rest, closes it again, and finds the rig in them
/// (vision/self_rig.h). Numbers of the robot file that the images contradict, or that it leaves to them, are replaced.
/// The lower view's azimuth follows from the heading of `start:`; without `start:` it is that of the file, or else 0.
/// Errors: those of opening and of images; kRefused, with what to change, if the images do not show a rig, and for
/// exchanged cameras; kCancelled once `stop` is set. @throws config::FileError as config::to_robot_settings
Result<SelfRigRobot> with_self_rig(const config::Robot& robot, const config::Map& map, const RunOptions& options,
                                   const std::atomic<bool>& stop);

/// Returns a warning with the numbers that the first images show if they contradict `rig:`, or what prevents an answer;
/// nothing if they agree.
std::optional<std::string> rig_warning(const config::Robot& robot, const config::Map& map, const Image& lower,
                                       const Image& upper);

}  // namespace twocone::runs
