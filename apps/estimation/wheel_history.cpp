// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/wheel_history.h"

#include <cassert>
#include <cmath>
#include <iterator>

namespace twocone::estimation {

void WheelHistory::add(const WheelAngles& reading) {
  readings_.push_back(reading);
  while (reading.time - readings_.front().time > kKept) readings_.pop_front();
}

WheelAngles WheelHistory::at(Timestamp time) const {
  assert(!readings_.empty());
  auto after = readings_.rbegin();  // queries are for recent times
  if ((time - after->time).count() >= 0) return *after;
  while (after != readings_.rend() && (time - after->time).count() < 0) ++after;
  if (after == readings_.rend()) return readings_.front();
  const WheelAngles& from = *after;
  const WheelAngles& to = *std::prev(after);
  const double share =
      std::chrono::duration<double>(time - from.time) / std::chrono::duration<double>(to.time - from.time);
  return {time, std::lerp(from.left_rad, to.left_rad, share), std::lerp(from.right_rad, to.right_rad, share)};
}

void BelievedPose::add_odometry(std::uint64_t frame, const localisation::Pose& pose) {
  assert(odometry_.empty() || frame > odometry_.back().frame);
  odometry_.push_back({frame, pose});
}

void BelievedPose::add_fix(std::uint64_t frame, const Eigen::Vector2d& position_m) {
  while (!odometry_.empty() && odometry_.front().frame < frame) odometry_.pop_front();
  assert(!odometry_.empty() && odometry_.front().frame == frame);
  const localisation::Pose& then = odometry_.front().pose;
  const Eigen::Vector2d wanted_m = position_m - Eigen::Vector2d(then.x_m, then.y_m);
  correction_m_ += kShare * (wanted_m - correction_m_);
}

localisation::Pose BelievedPose::pose() const {
  assert(!odometry_.empty());
  const localisation::Pose& now = odometry_.back().pose;
  return {now.x_m + correction_m_.x(), now.y_m + correction_m_.y(), now.heading_rad};
}

}  // namespace twocone::estimation
