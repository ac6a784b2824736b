// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/track.h"

#include <cassert>
#include <cmath>
#include <iterator>
#include <numbers>

#include "apps/config/to_layers.h"

namespace twocone::estimation {
namespace {

using localisation::FixUse;

/// Returns the position of the fix, with this heading, as the pose.
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

/// Standard deviation of a position, m, from which on a pose by the plan is searched for around it.
constexpr double kVague_m = 0.1;

}  // namespace

std::optional<localisation::PlanFix> place_on_plan(const localisation::FloorPlan& plan,
                                                   const std::vector<vision::Beam>& beams,
                                                   const localisation::Pose& expected, bool is_vague) {
  constexpr double kOff_m = 0.3;
  constexpr double kOff_rad = 10 * std::numbers::pi / 180;
  constexpr double kReach_m = 0.2;
  std::vector<localisation::ScanPoint> points;
  for (std::size_t k = 0; k < beams.size(); ++k) {
    if (beams[k].state != vision::BeamState::kOccupied) continue;
    const double beam_rad = vision::beam_bearing_rad(k, beams.size());
    points.push_back({beams[k].range_m * Eigen::Vector2d(std::cos(beam_rad), std::sin(beam_rad)), beams[k].sigma_m});
  }
  return is_vague ? find_by_plan(plan, points, expected, kOff_m, kOff_rad)
                  : fix_by_plan(plan, points, expected, kReach_m);
}

Track::Track(Method method, const config::Robot& robot, const config::Map& map) {
  if (method != Method::kOutline) return;
  filter_.emplace(config::to_wheels(robot), localisation::OdometryNoise{}, config::to_belief_errors(robot, map).wheels);
  if (!robot.estimator.plan) return;
  plan_.emplace(
      Plan{config::to_floor_plan(map), localisation::Odometry(config::to_wheels(robot), config::to_start_pose(robot))});
}

FixUse Track::follow_plan(const std::vector<vision::Beam>& scan) {
  const auto estimate = filter_->estimate();
  const double sigma_m = estimate ? std::sqrt(estimate->covariance.topLeftCorner<2, 2>().trace()) : kVague_m;
  const auto placed =
      place_on_plan(plan_->walls, scan, estimate ? estimate->pose : plan_->from_start.pose(), sigma_m >= kVague_m);
  if (!placed) return FixUse::kNoFix;
  return filter_->correct_by_second_source(placed->pose, placed->covariance);
}

TrackAnswer Track::follow(double t_s, double left_rad, double right_rad, double odometry_heading_rad,
                          const localisation::Fix& fix, const std::vector<vision::Beam>& scan) {
  if (!filter_) return take_alone(fix, odometry_heading_rad);
  filter_->predict(t_s, left_rad, right_rad);
  TrackAnswer answer;
  answer.use = filter_->correct(fix);
  if (plan_) {
    plan_->from_start.update(left_rad, right_rad);
    answer.plan_use = follow_plan(scan);
  }
  answer.state = filter_->state();
  if (const auto estimate = filter_->estimate()) {
    answer.position_m = Eigen::Vector2d(estimate->pose.x_m, estimate->pose.y_m);
    answer.heading_rad = estimate->pose.heading_rad;
    answer.covariance = estimate->covariance;
  }
  return answer;
}

TrackAnswer track_without_wheels(const localisation::Fix& fix) { return take_alone(fix, fix.heading_rad); }

void WheelHistory::add(const WheelAngles& reading) {
  readings_.push_back(reading);
  while (reading.time - readings_.front().time > kKept) readings_.pop_front();
}

WheelAngles WheelHistory::at(Timestamp time) const {
  assert(!readings_.empty());
  auto after = readings_.rbegin();  // from the newest reading, because queries are for recent times
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

const localisation::Pose& BelievedPose::odometry_at(std::uint64_t frame) {
  while (!odometry_.empty() && odometry_.front().frame < frame) odometry_.pop_front();
  assert(!odometry_.empty() && odometry_.front().frame == frame);
  return odometry_.front().pose;
}

Eigen::Vector2d BelievedPose::turned_m(const localisation::Pose& odometry) const {
  return Eigen::Rotation2Dd(turn_rad_) * Eigen::Vector2d(odometry.x_m, odometry.y_m);
}

localisation::Pose BelievedPose::corrected(const localisation::Pose& odometry) const {
  const Eigen::Vector2d place_m = turned_m(odometry) + correction_m_;
  return {place_m.x(), place_m.y(), localisation::wrap_angle_rad(odometry.heading_rad + turn_rad_)};
}

void BelievedPose::add_fix(std::uint64_t frame, const Eigen::Vector2d& position_m) {
  const Eigen::Vector2d wanted_m = position_m - turned_m(odometry_at(frame));
  correction_m_ += kShare * (wanted_m - correction_m_);
}

void BelievedPose::add_estimate(std::uint64_t frame, const localisation::Pose& pose) {
  const localisation::Pose& then = odometry_at(frame);
  turn_rad_ = localisation::wrap_angle_rad(pose.heading_rad - then.heading_rad);
  correction_m_ = Eigen::Vector2d(pose.x_m, pose.y_m) - turned_m(then);
}

localisation::Pose BelievedPose::pose() const {
  assert(!odometry_.empty());
  return corrected(odometry_.back().pose);
}

}  // namespace twocone::estimation
