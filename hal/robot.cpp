// SPDX-License-Identifier: Apache-2.0
#include "hal/robot.h"

#include <stdexcept>

namespace twocone {

Robot::Robot(StereoRig cameras, std::unique_ptr<DiffDrive> drive, std::unique_ptr<GroundTruth> truth)
    : cameras_(std::move(cameras)), drive_(std::move(drive)), truth_(std::move(truth)) {
  if (!drive_) throw std::invalid_argument("Robot: needs a drive");
}

Robot::~Robot() { stop(); }

Status Robot::start(const CameraSettings& lower, const CameraSettings& upper) { return cameras_.start(lower, upper); }

Result<StereoFrame> Robot::next_frame(std::chrono::milliseconds timeout) { return cameras_.grab(timeout); }

std::optional<Pose2> Robot::true_pose() const {
  if (!truth_) return std::nullopt;
  return truth_->true_pose();
}

void Robot::stop() noexcept {
  // The dead-man rule covers a drive that cannot be told; there is nobody left to hand the error to.
  if (drive_) (void)drive_->stop();
  cameras_.stop();
}

}  // namespace twocone
