// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/estimation/track.h"
#include "apps/runlog/run_folder.h"
#include "hal/result.h"
#include "hal/robot.h"
#include "localisation/odometry.h"

/// Frames from a robot: taking pairs of images, waiting for their pixels, and outliving devices that fail.
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

/// Decides how long failing devices are asked again, and reports the begin and the end of each stretch of failures.
///
/// A stretch begins with the first failure and ends when everything answers again. A frame that only came damaged
/// (kBadData) does not last: its begin is reported, and it has no end.
class FaultPolicy {
 public:
  /// @param patience how long one stretch may last; 0: the first failure ends the run
  /// @param notify gets each sentence at once
  FaultPolicy(std::chrono::milliseconds patience, std::function<void(const std::string&)> notify);

  /// One more failure. An error is the reason to give up: `error` with the frame's number.
  Status failed(std::uint64_t frame, const Error& error);
  /// Everything answers.
  void over(std::uint64_t frame);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  const std::chrono::milliseconds patience_;
  const std::function<void(const std::string&)> notify_;
  std::optional<SteadyTime> since_;
  bool has_end_ = false;
};

/// A frame that has been taken; its images may still be on their way.
struct TakenFrame {
  StereoFrame frame;
  runlog::FrameRecord record;  ///< without an answer
  std::vector<NamedFrame> others;
};

/// Takes frames from a robot and commands its wheels, and outlives devices that fail: it stops the wheels and asks
/// again until the devices answer or the patience is at its end.
class FrameTaker {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;

  /// @param run_begin of the record's host_t_s; `clock_before_s` is added to it (a resumed run)
  /// @param patience for devices that fail; not used for a robot whose world waits for the program
  /// @param notify gets a sentence for each event at once
  FrameTaker(Robot& robot, const config::Robot& description, SteadyTime run_begin, double clock_before_s,
             std::chrono::milliseconds patience, std::function<void(const std::string&)> notify);

  /// The next frame, with its times, wheel angles, odometry and truth. After an error the wheels are stopped.
  /// Errors: those of Robot::next_frame and PairTaker::take with the frame's number; kCancelled once `stop` is set.
  Result<TakenFrame> take(std::uint64_t number, const std::atomic<bool>& stop);
  /// Commands the wheels. Errors: those of DiffDrive once the patience is at its end.
  Status command(std::uint64_t number, const WheelSpeeds& speeds);

  /// Time since the frame before, or one period where the robot did not drive in between.
  [[nodiscard]] double step_s() const { return step_s_; }
  /// How long ago the newest frame came.
  [[nodiscard]] double age_s() const { return seconds_since(taken_at_); }
  /// Frames of the lower and upper camera that were passed over for newer ones so far.
  [[nodiscard]] std::uint64_t lower_skipped() const { return lower_skipped_; }
  [[nodiscard]] std::uint64_t upper_skipped() const { return upper_skipped_; }

 private:
  Result<TakenPair> take_pair(std::uint64_t number, const std::atomic<bool>& stop);
  void stop_wheels();
  void note_contact(std::uint64_t number, const std::string& contact);

  Robot& robot_;
  const RobotPace pace_;
  const double period_s_;  ///< of the lower camera, as applied
  const SteadyTime run_begin_;
  const double clock_before_s_;
  const std::function<void(const std::string&)> notify_;
  FaultPolicy fault_policy_;
  PairTaker pairs_;
  WheelSpeeds command_;
  SteadyTime taken_at_;
  std::string contact_;
  double last_t_s_ = 0;
  double step_s_ = 0;
  bool was_stopped_ = false;
  std::uint64_t lower_skipped_ = 0, upper_skipped_ = 0;
};

}  // namespace twocone::runs
