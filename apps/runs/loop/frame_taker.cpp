// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/frame_taker.h"

#include <thread>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "base/log.h"

namespace twocone::runs {
namespace {

constexpr std::chrono::milliseconds kBetweenTries{10};
constexpr std::chrono::milliseconds kImageTimeout{150'000};

/// Replaces the camera's pixels, which must have arrived already, by rgb8 pixels.
Status decode(Frame& frame) {
  const auto image = frame.image(std::chrono::milliseconds(0));
  if (!image) return image.error();
  auto rgb = to_rgb8(**image);
  if (!rgb) return rgb.error();
  // to_rgb8() returns the pixels of an rgb8 camera unchanged. They are copied to return the buffer to the device.
  if (rgb->bytes.is_lent()) rgb->bytes = Bytes((*image)->bytes.begin(), (*image)->bytes.end());
  frame = Frame(frame.header(), std::move(*rgb));
  return {};
}

Status decode(StereoFrame& frame) {
  if (auto decoded = decode(frame.lower); !decoded) return with_name("lower", decoded.error());
  if (auto decoded = decode(frame.upper); !decoded) return with_name("upper", decoded.error());
  return {};
}

}  // namespace

Result<TakenPair> PairTaker::take(Robot& robot, StereoFrame frame) {
  const auto arrived = std::chrono::steady_clock::now();
  const auto reading = robot.drive().read_angles();
  if (!reading) return with_name("drive", reading.error());
  if (!robot.pace().waits_for_program) {
    if (auto decoded = decode(frame); !decoded) return decoded.error();
  }
  wheels_.add(*reading);
  const Timestamp captured = frame.lower.header().captured;
  const WheelAngles angles = wheels_.at(captured);
  if (!zero_s_) zero_s_ = captured.seconds();
  const double t_s = captured.seconds() - *zero_s_;
  const double upper_t_s = frame.upper.header().captured.seconds() - *zero_s_;
  const localisation::Pose& odometry = odometry_.update(angles.left_rad, angles.right_rad);
  return TakenPair{std::move(frame), arrived, t_s, upper_t_s, angles, odometry};
}

ImageResult wait_for_image(const Frame& frame, const IsStopped& is_stopped) {
  const auto deadline = std::chrono::steady_clock::now() + kImageTimeout;
  while (true) {
    const auto begin = std::chrono::steady_clock::now();
    auto image = frame.image(kStopSlice);
    const auto now = std::chrono::steady_clock::now();
    // A time-out that is reported earlier is the renderer's, not that of this wait.
    const bool is_pending = !image && image.error().code == ErrorCode::kTimeout && now - begin >= kStopSlice / 2;
    if (!is_pending || now >= deadline) return image;
    if (is_stopped()) return Error{ErrorCode::kCancelled, "interrupted while its image was awaited"};
  }
}

Result<std::pair<std::shared_ptr<const Image>, std::shared_ptr<const Image>>> wait_for_images(
    const StereoFrame& frame, const IsStopped& is_stopped) {
  const auto lower = wait_for_image(frame.lower, is_stopped);
  if (!lower) return lower.error();
  const auto upper = wait_for_image(frame.upper, is_stopped);
  if (!upper) return upper.error();
  return std::pair(*lower, *upper);
}

FaultPolicy::FaultPolicy(std::chrono::milliseconds patience, std::function<void(const std::string&)> notify)
    : patience_(patience), notify_(std::move(notify)) {}

Status FaultPolicy::failed(std::uint64_t frame, const Error& error) {
  const SteadyTime now = std::chrono::steady_clock::now();
  const std::string what = fmt::format("frame {}: {}", frame, error.message);
  if (patience_.count() == 0) return Error{error.code, what};
  const bool begins = !since_;
  if (begins) since_ = now;
  if (now - *since_ >= patience_) {
    return Error(error.code, "{}, and so it stayed for {} s", what, std::chrono::duration<double>(patience_).count());
  }
  base::Logger("run").warning(what + "; tried again");
  const bool ends = error.code != ErrorCode::kBadData;
  if (ends && !has_end_) {
    notify_(fmt::format("{}: the wheels are stopped until it answers again", what));
  } else if (begins) {
    notify_(what);
  }
  has_end_ = has_end_ || ends;
  return {};
}

void FaultPolicy::over(std::uint64_t frame) {
  if (since_ && has_end_) {
    const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - *since_;
    notify_(fmt::format("frame {}: all is well again after {:.1f} s", frame, lasted.count()));
  }
  since_.reset();
  has_end_ = false;
}

FrameTaker::FrameTaker(Robot& robot, const config::Robot& description, SteadyTime run_begin, double clock_before_s,
                       std::chrono::milliseconds patience, std::function<void(const std::string&)> notify)
    : robot_(robot),
      pace_(robot.pace()),
      period_s_(1 / robot.cameras().lower().facts().settings.rate_hz),
      run_begin_(run_begin),
      clock_before_s_(clock_before_s),
      notify_(std::move(notify)),
      fault_policy_(pace_.waits_for_program ? std::chrono::milliseconds(0) : patience, notify_),
      pairs_(config::to_wheels(description), config::to_start_pose(description)) {}

Result<TakenPair> FrameTaker::take_pair(std::uint64_t number, const std::atomic<bool>& stop) {
  while (true) {
    auto frame = robot_.next_frame(pace_.frame_timeout);
    auto pair = frame ? pairs_.take(robot_, *std::move(frame)) : Result<TakenPair>(frame.error());
    if (pair) return pair;
    const Status bearable = fault_policy_.failed(number, pair.error());
    if (!bearable || stop || pair.error().code != ErrorCode::kBadData) stop_wheels();
    if (!bearable) return bearable.error();
    if (stop) return Error(ErrorCode::kCancelled, "interrupted while frame {} was awaited", number);
    std::this_thread::sleep_for(kBetweenTries);
  }
}

void FrameTaker::stop_wheels() {
  command_ = {};
  was_stopped_ = true;
  // If the command does not arrive, the dead-man rule stops the wheels.
  if (!robot_.drive().stop()) base::Logger("run").warning("a stop of the wheels was not confirmed");
}

Result<TakenFrame> FrameTaker::take(std::uint64_t number, const std::atomic<bool>& stop) {
  auto pair = take_pair(number, stop);
  if (!pair) return pair.error();
  auto& [frame, arrived, t_s, upper_t_s, angles, pose] = *pair;
  taken_at_ = arrived;
  const Frame::Header& lower = frame.lower.header();
  const Frame::Header& upper = frame.upper.header();
  runlog::FrameRecord record;
  const double skew_s = std::chrono::duration<double>(frame.skew()).count();
  record.frame = {number, t_s, skew_s, t_s, upper_t_s, lower.sequence, upper.sequence};
  record.frame.lower_lost = lower.lost_before;
  record.frame.upper_lost = upper.lost_before;
  record.frame.host_t_s = clock_before_s_ + seconds_since(run_begin_);
  record.drive = {t_s, command_.left_radps, command_.right_radps, angles.left_rad, angles.right_rad};
  record.odometry = {t_s, pose.x_m, pose.y_m, pose.heading_rad};
  if (const auto truth = robot_.true_pose()) {
    record.truth = runlog::PoseRow{t_s, truth->x_m, truth->y_m, truth->heading_rad};
  }
  note_contact(number, robot_.contact());
  // The time during which the robot did not drive does not count as a step of its behaviour.
  const bool is_first = number == 0 || std::exchange(was_stopped_, false);
  step_s_ = is_first ? period_s_ : t_s - last_t_s_;
  last_t_s_ = t_s;
  if (number > 0 && lower.lost_before + upper.lost_before > 0) base::Logger("run").warning("frames were lost or late");
  lower_skipped_ += lower.skipped_before;
  upper_skipped_ += upper.skipped_before;
  return TakenFrame{std::move(frame), std::move(record), robot_.other_frames()};
}

void FrameTaker::note_contact(std::uint64_t number, const std::string& contact) {
  if (contact != contact_ && !contact.empty()) {
    notify_(fmt::format("collision: at frame {} the robot touches {}", number, contact));
  }
  contact_ = contact;
}

Status FrameTaker::command(std::uint64_t number, const WheelSpeeds& speeds) {
  const auto applied = robot_.drive().set_speeds(speeds);
  if (!applied) {
    command_ = {};
    return fault_policy_.failed(number, with_name("drive", applied.error()));
  }
  command_ = *applied;
  fault_policy_.over(number);
  return {};
}

}  // namespace twocone::runs
