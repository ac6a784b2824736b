// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/track.h"

#include "apps/files/to_layers.h"

namespace twocone::runs {

Track::Track(Method method, const files::Robot& robot) {
  if (method == Method::kFull) filter_.emplace(files::to_wheels(robot), localisation::OdometryNoise{});
}

std::optional<PoseRow> Track::follow(const DriveRow& drive, const PoseRow& odometry, const localisation::Fix& fix) {
  if (!filter_) {
    if (!fix.position_m || fix.other_position_m) return std::nullopt;
    return PoseRow{odometry.t_s, fix.position_m->x(), fix.position_m->y(), odometry.heading_rad};
  }
  filter_->predict(drive.t_s, drive.left_rad, drive.right_rad);
  filter_->correct(fix);
  const auto estimate = filter_->estimate();
  if (!estimate) return std::nullopt;
  return PoseRow{odometry.t_s, estimate->pose.x_m, estimate->pose.y_m, estimate->pose.heading_rad};
}

std::optional<PoseRow> pose_of(double t_s, const localisation::Fix& fix) {
  if (!fix.position_m || !fix.heading_rad || fix.other_position_m) return std::nullopt;
  return PoseRow{t_s, fix.position_m->x(), fix.position_m->y(), *fix.heading_rad};
}

}  // namespace twocone::runs
