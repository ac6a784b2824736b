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

/// Takes pairs of images from a robot, waits for their pixels, and continues after failures of devices.
namespace twocone::runs {

/// A pair of images, whose pixels may not have arrived yet, and the motion of the wheels until it was taken.
struct TakenPair {
  StereoFrame frame;
  std::chrono::steady_clock::time_point arrived;
  double t_s = 0, upper_t_s = 0;  ///< of the lower and the upper image, since the first pair's lower one
  WheelAngles angles;             ///< at t_s
  localisation::Pose odometry;    ///< likewise
};

/// Adds to each pair of images its times, wheel angles and odometry.
class PairTaker {
 public:
  PairTaker(const localisation::WheelGeometry& wheels, const localisation::Pose& start) : odometry_(wheels, start) {}

  /// Takes the frame that Robot::next_frame() has just returned, and reads the wheels. The pixels of a device have
  /// arrived already, so its pair is decoded at once. A damaged pair is thus found while another can still be taken,
  /// and lent buffers are returned. Does not stop the wheels after an error. Errors: those of DiffDrive::read_angles,
  /// Frame::image and to_rgb8().
  Result<TakenPair> take(Robot& robot, StereoFrame frame);

 private:
  localisation::Odometry odometry_;
  estimation::WheelHistory wheels_;
  std::optional<double> zero_s_;  ///< time of the first lower image
};

/// Asked at least every kStopSlice during a wait, on the thread that waits; true ends the wait.
using IsStopped = std::function<bool()>;

/// Waits for a frame's pixels, at most 150 s. This is longer than a renderer's own limit for one image, so the
/// renderer's message is the one that is reported. Errors: those of Frame::image; kCancelled once it is stopped.
ImageResult wait_for_image(const Frame& frame, const IsStopped& is_stopped);
/// Waits for the pixels of both views, in the same way.
Result<std::pair<std::shared_ptr<const Image>, std::shared_ptr<const Image>>> wait_for_images(
    const StereoFrame& frame, const IsStopped& is_stopped);

/// Interval at which a wait checks whether it must end.
constexpr std::chrono::milliseconds kStopSlice{100};

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Decides how long failing devices are tried again, and reports the start and the end of each series of failures.
///
/// A series starts with the first failure and ends when all devices answer again. A series of nothing but damaged
/// frames (kBadData) is reported once, without an end.
class FaultPolicy {
 public:
  /// @param patience longest duration of one series; 0: the first failure ends the run
  /// @param notify receives each sentence at once
  FaultPolicy(std::chrono::milliseconds patience, std::function<void(const std::string&)> notify);

  /// Counts one more failure. Returns an error if the run must end: `error` with the frame's number.
  Status failed(std::uint64_t frame, const Error& error);
  /// Ends the series of failures, because all devices answer.
  void over(std::uint64_t frame);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  const std::chrono::milliseconds patience_;
  const std::function<void(const std::string&)> notify_;
  std::optional<SteadyTime> since_;
  bool has_end_ = false;
};

/// A frame that has been taken. The pixels of its images may not have arrived yet.
struct TakenFrame {
  StereoFrame frame;
  runlog::FrameRecord record;  ///< without an answer
  std::vector<NamedFrame> others;
};

/// Takes frames from a robot and commands its wheels. If a device fails, it stops the wheels and tries again until the
/// device answers or the patience ends.
class FrameTaker {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;

  /// @param run_begin zero of the record's host_t_s
  /// @param clock_before_s added to host_t_s (a resumed run)
  /// @param patience for devices that fail; not used for a robot whose world waits for the program
  /// @param notify receives a sentence for each event at once
  FrameTaker(Robot& robot, const config::Robot& description, SteadyTime run_begin, double clock_before_s,
             std::chrono::milliseconds patience, std::function<void(const std::string&)> notify);

  /// Returns the next frame, with its times, wheel angles, odometry and truth. After an error the wheels are stopped.
  /// Errors: those of Robot::next_frame and PairTaker::take with the frame's number; kCancelled once `stop` is set.
  Result<TakenFrame> take(std::uint64_t number, const std::atomic<bool>& stop);
  /// Commands the wheels. Errors: those of DiffDrive once the patience has ended.
  Status command(std::uint64_t number, const WheelSpeeds& speeds);

  /// Returns the time since the previous frame, or one period if the robot did not drive in between.
  [[nodiscard]] double step_s() const { return step_s_; }
  /// Returns the time since the newest frame arrived.
  [[nodiscard]] double age_s() const { return seconds_since(taken_at_); }
  /// Return the number of frames of the lower or upper camera that were skipped for newer ones so far.
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
