// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "apps/estimation/wheel_history.h"
#include "hal/robot.h"
#include "localisation/odometry.h"

/// Pairs of images from a robot: taking them, and waiting for their pixels.
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
  /// given back. Errors: those of DiffDrive::read_angles, Frame::image and to_rgb8(). None of them stops the wheels.
  Result<TakenPair> take(Robot& robot, StereoFrame frame);

 private:
  localisation::Odometry odometry_;
  estimation::WheelHistory wheels_;
  std::optional<double> zero_s_;  ///< time of the first lower image
};

/// Waits for a frame's pixels, at most 150 s, which is longer than a renderer's own limit for one image, so that the
/// renderer's message is the one that is reported. Errors: those of Frame::image; kCancelled once `stop` is set.
ImageResult wait_for_image(const Frame& frame, const std::atomic<bool>& stop);
/// Waits for the pixels of both views, in the same way.
Result<std::pair<std::shared_ptr<const Image>, std::shared_ptr<const Image>>> wait_for_images(
    const StereoFrame& frame, const std::atomic<bool>& stop);

/// How often a wait looks whether it must end.
constexpr std::chrono::milliseconds kStopSlice{100};

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace twocone::runs
