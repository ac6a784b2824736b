// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>

#include "apps/estimation/wheel_history.h"
#include "hal/robot.h"
#include "localisation/odometry.h"

namespace twocone::runs {

/// A pair of images, which may still be on their way, and the motion of the wheels until it was taken.
struct TakenPair {
  StereoFrame frame;
  std::chrono::steady_clock::time_point arrived;
  double t_s = 0, upper_t_s = 0;  ///< of the lower and the upper image, since the first pair's lower one
  WheelAngles angles;             ///< at t_s
  localisation::Pose odometry;    ///< likewise
};

/// Adds to each pair of images what else belongs to its moment.
class PairTaker {
 public:
  PairTaker(const localisation::WheelGeometry& wheels, const localisation::Pose& start) : odometry_(wheels, start) {}

  /// Takes what Robot::next_frame() has just returned, and reads the wheels. Of devices, whose pixels are there
  /// already, the pair is decoded: a damaged one is found while there still is another to take, and lent buffers are
  /// given back. Errors: those of DiffDrive::read_angles and decode(). None of them stops the wheels.
  Result<TakenPair> take(Robot& robot, StereoFrame frame);

 private:
  localisation::Odometry odometry_;
  estimation::WheelHistory wheels_;
  std::optional<double> zero_s_;  ///< time of the first lower image
};

}  // namespace twocone::runs
