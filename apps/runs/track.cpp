// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/track.h"

#include "apps/files/to_layers.h"

namespace twocone::runs {

namespace {

using localisation::FixUse;

TrackRow row_of(std::uint64_t frame, double t_s, const localisation::Fix& fix) {
  TrackRow row;
  row.frame = frame;
  row.t_s = t_s;
  row.fix = to_string(fix.verdict);
  return row;
}

/// The pose is the fix's position, without a filter.
void take_alone(const localisation::Fix& fix, const std::optional<double>& heading_rad, TrackRow& row) {
  const auto use = [&] {
    if (!fix.position_m) return FixUse::kNoFix;
    if (fix.verdict == localisation::FixVerdict::kOutOfBounds) return FixUse::kOutOfBounds;
    if (fix.other_position_m) return FixUse::kUndecided;
    return is_place(fix) && heading_rad ? FixUse::kTaken : FixUse::kCannotStart;
  }();
  row.use = to_string(use);
  if (use != FixUse::kTaken) return;
  row.x_m = fix.position_m->x();
  row.y_m = fix.position_m->y();
  row.heading_rad = heading_rad;
}

}  // namespace

Track::Track(Method method, const files::Robot& robot) {
  if (method == Method::kFull) filter_.emplace(files::to_wheels(robot), localisation::OdometryNoise{});
}

TrackRow Track::follow(std::uint64_t frame, const DriveRow& drive, const PoseRow& odometry,
                       const localisation::Fix& fix) {
  TrackRow row = row_of(frame, odometry.t_s, fix);
  if (!filter_) {
    take_alone(fix, odometry.heading_rad, row);
    return row;
  }
  filter_->predict(drive.t_s, drive.left_rad, drive.right_rad);
  row.use = to_string(filter_->correct(fix));
  row.state = to_string(filter_->state());
  const auto estimate = filter_->estimate();
  if (!estimate) return row;
  row.x_m = estimate->pose.x_m;
  row.y_m = estimate->pose.y_m;
  row.heading_rad = estimate->pose.heading_rad;
  const Eigen::Matrix3d& c = estimate->covariance;
  row.var_x_m2 = c(0, 0);
  row.cov_xy_m2 = c(0, 1);
  row.var_y_m2 = c(1, 1);
  row.cov_x_heading_m_rad = c(0, 2);
  row.cov_y_heading_m_rad = c(1, 2);
  row.var_heading_rad2 = c(2, 2);
  return row;
}

TrackRow track_row(std::uint64_t frame, double t_s, const localisation::Fix& fix) {
  TrackRow row = row_of(frame, t_s, fix);
  take_alone(fix, fix.heading_rad, row);
  return row;
}

}  // namespace twocone::runs
