// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/believed_pose.h"

#include <cassert>

namespace twocone::estimation {

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
