// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/track.h"

#include "apps/config/to_layers.h"

namespace twocone::estimation {
namespace {

using localisation::FixUse;

/// Takes the position of the fix as the pose, without a filter.
TrackAnswer take_alone(const localisation::Fix& fix, const std::optional<double>& heading_rad) {
  TrackAnswer answer;
  answer.use = [&] {
    if (!fix.position_m) return FixUse::kNoFix;
    if (fix.verdict == localisation::FixVerdict::kOutOfBounds) return FixUse::kOutOfBounds;
    if (fix.other_position_m) return FixUse::kUndecided;
    return is_place(fix) && heading_rad ? FixUse::kTaken : FixUse::kCannotStart;
  }();
  if (answer.use != FixUse::kTaken) return answer;
  answer.position_m = fix.position_m;
  answer.heading_rad = heading_rad;
  return answer;
}

}  // namespace

Track::Track(Method method, const config::Robot& robot) {
  if (method == Method::kOutline) filter_.emplace(config::to_wheels(robot), localisation::OdometryNoise{});
}

TrackAnswer Track::follow(double t_s, double left_rad, double right_rad, double odometry_heading_rad,
                          const localisation::Fix& fix) {
  if (!filter_) return take_alone(fix, odometry_heading_rad);
  filter_->predict(t_s, left_rad, right_rad);
  TrackAnswer answer;
  answer.use = filter_->correct(fix);
  answer.state = filter_->state();
  if (const auto estimate = filter_->estimate()) {
    answer.position_m = Eigen::Vector2d(estimate->pose.x_m, estimate->pose.y_m);
    answer.heading_rad = estimate->pose.heading_rad;
    answer.covariance = estimate->covariance;
  }
  return answer;
}

TrackAnswer track_without_wheels(const localisation::Fix& fix) { return take_alone(fix, fix.heading_rad); }

}  // namespace twocone::estimation
