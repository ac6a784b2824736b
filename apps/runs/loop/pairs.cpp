// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/pairs.h"

namespace twocone::runs {
namespace {

constexpr std::chrono::milliseconds kImageTimeout{150'000};

/// Puts rgb8 pixels in the place of the camera's own, which must be there already.
Status decode(Frame& frame) {
  const auto image = frame.image(std::chrono::milliseconds(0));
  if (!image) return image.error();
  auto rgb = to_rgb8(**image);
  if (!rgb) return rgb.error();
  // What the camera sends as rgb8 already comes back as it is: a copy, so that the buffer is the device's again.
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

ImageResult wait_for_image(const Frame& frame, const std::atomic<bool>& stop) {
  const auto deadline = std::chrono::steady_clock::now() + kImageTimeout;
  while (true) {
    const auto begin = std::chrono::steady_clock::now();
    auto image = frame.image(kStopSlice);
    const auto now = std::chrono::steady_clock::now();
    // A time-out that comes at once is the renderer's, not this wait's.
    const bool is_pending = !image && image.error().code == ErrorCode::kTimeout && now - begin >= kStopSlice / 2;
    if (!is_pending || now >= deadline) return image;
    if (stop) return Error{ErrorCode::kCancelled, "interrupted while its image was awaited"};
  }
}

Result<std::pair<std::shared_ptr<const Image>, std::shared_ptr<const Image>>> wait_for_images(
    const StereoFrame& frame, const std::atomic<bool>& stop) {
  const auto lower = wait_for_image(frame.lower, stop);
  if (!lower) return lower.error();
  const auto upper = wait_for_image(frame.upper, stop);
  if (!upper) return upper.error();
  return std::pair(*lower, *upper);
}

}  // namespace twocone::runs
