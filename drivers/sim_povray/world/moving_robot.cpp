// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/moving_robot.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace twocone::sim_povray {
namespace {

double seconds(std::chrono::nanoseconds span) { return std::chrono::duration<double>(span).count(); }

}  // namespace

MovingRobot::MovingRobot(const RobotBody& body)
    : body_(body),
      left_slip_(body.wheels.slip, body.wheels.slip_correlation_s, engine_for(body.seed, Purpose::kLeftSlip)),
      right_slip_(body.wheels.slip, body.wheels.slip_correlation_s, engine_for(body.seed, Purpose::kRightSlip)),
      pose_(wrapped(body.begin.value_or(body.start))),
      begin_pose_(pose_) {}

void MovingRobot::command(const WheelSpeeds& speeds, std::chrono::nanoseconds now) {
  command_ = speeds;
  commanded_at_ = now;
}

void MovingRobot::abandon() {
  halt();
  lagging_ = {};
  engine_body.reset();
}

void MovingRobot::begin_step(std::chrono::nanoseconds now, std::chrono::nanoseconds span) {
  // As a difference: now + timeout would overflow for a time-out of centuries.
  const auto alive = std::max(body_.command_timeout - (now - commanded_at_), std::chrono::nanoseconds(0));
  const double driven_s = seconds(std::min(alive, span));
  const double lag_s = body_.wheels.lag_s;
  step_s_ = seconds(span);
  left_ = {lagging_.left_radps, command_.left_radps, driven_s, lag_s};
  right_ = {lagging_.right_radps, command_.right_radps, driven_s, lag_s};
  begin_pose_ = pose_;
  stopped_s_.reset();
  fastest_mps_ = 0;
  arcs_.clear();
  waypoints_.clear();
  if (engine_body) {
    waypoints_.push_back({0, pose_});
  } else if (lag_s == 0) {
    if (command_ != WheelSpeeds{} && driven_s > 0) {
      add_arc(0, driven_s, on_floor(command_.left_radps, command_.right_radps));
    }
  } else {
    add_lagging_arcs(0, driven_s);
    add_lagging_arcs(driven_s, step_s_);
  }
}

GroundSpeeds MovingRobot::on_floor(double left_radps, double right_radps) const {
  return {left_radps * body_.wheels.radius_m * (1 + left_slip_.value()),
          right_radps * body_.wheels.radius_m * (1 + right_slip_.value())};
}

GroundSpeeds MovingRobot::rim_speeds(double from_s, double to_s) const {
  return on_floor((left_.turned_rad(to_s) - left_.turned_rad(from_s)) / (to_s - from_s),
                  (right_.turned_rad(to_s) - right_.turned_rad(from_s)) / (to_s - from_s));
}

void MovingRobot::add_arc(double begin_s, double end_s, const GroundSpeeds& ground) {
  const BodySpeeds speeds = body_speeds(ground, body_.wheels.separation_m);
  arcs_.push_back({begin_s, end_s, pose_, speeds});
  pose_ = advance(pose_, speeds, end_s - begin_s);
  fastest_mps_ = std::max(fastest_mps_, std::abs(speeds.speed_mps));
}

void MovingRobot::add_lagging_arcs(double begin_s, double end_s) {
  if (end_s <= begin_s) return;
  const double told = begin_s < left_.driven_s ? 1 : 0;
  const WheelSpeeds to{told * command_.left_radps, told * command_.right_radps};
  const int pieces = int(std::ceil((end_s - begin_s) / kLagArc_s));
  double from_s = begin_s;
  for (int i = 1; i <= pieces; ++i) {
    if (WheelSpeeds{left_.speed_radps(from_s), right_.speed_radps(from_s)} == to) {  // all the rest is one arc
      if (to != WheelSpeeds{}) add_arc(from_s, end_s, on_floor(to.left_radps, to.right_radps));
      return;
    }
    const double to_s = i == pieces ? end_s : begin_s + (end_s - begin_s) * i / pieces;
    add_arc(from_s, to_s, rim_speeds(from_s, to_s));
    from_s = to_s;
  }
}

const MovingRobot::Arc* MovingRobot::arc_at(double time_s) const {
  if (stopped_s_ && time_s >= *stopped_s_) return nullptr;
  const auto next = std::upper_bound(arcs_.begin(), arcs_.end(), time_s,
                                     [](double time, const Arc& arc) { return time < arc.begin_s; });
  if (next == arcs_.begin() || time_s >= std::prev(next)->end_s) return nullptr;
  return &*std::prev(next);
}

Pose2 MovingRobot::pose_at(double time_s) const {
  if (!waypoints_.empty()) {
    const auto next = std::upper_bound(waypoints_.begin(), waypoints_.end(), time_s,
                                       [](double time, const Waypoint& w) { return time < w.time_s; });
    if (next == waypoints_.end()) return pose_;
    if (next == waypoints_.begin()) return begin_pose_;
    const Waypoint& from = *std::prev(next);
    const double share = (time_s - from.time_s) / (next->time_s - from.time_s);
    return {from.pose.x_m + share * (next->pose.x_m - from.pose.x_m),
            from.pose.y_m + share * (next->pose.y_m - from.pose.y_m),
            wrap_angle(from.pose.heading_rad + share * wrap_angle(next->pose.heading_rad - from.pose.heading_rad))};
  }
  if (arcs_.empty() || time_s <= arcs_.front().begin_s) return begin_pose_;
  const Arc* arc = arc_at(time_s);
  if (arc == nullptr) return pose_;
  return time_s == arc->begin_s ? arc->from : advance(arc->from, arc->speeds, time_s - arc->begin_s);
}

Pose2 MovingRobot::pose_before(double before_s) const {
  return before_s <= 0 ? pose_ : pose_at(std::max(step_s_ - before_s, 0.0));
}

Stretch MovingRobot::stretch(double time_s) const {
  if (engine_body) {
    const double since_s = time_s - waypoints_.back().time_s;
    return {{pose_.x_m + since_s * motion_.x_mps, pose_.y_m + since_s * motion_.y_mps}, motion_.x_mps, motion_.y_mps};
  }
  const Pose2 at = pose_at(time_s);
  Stretch stretch{{at.x_m, at.y_m}};
  if (const Arc* arc = arc_at(time_s)) {
    stretch.x_mps = arc->speeds.speed_mps * std::cos(at.heading_rad);
    stretch.y_mps = arc->speeds.speed_mps * std::sin(at.heading_rad);
    stretch.bend_mps2 = std::abs(arc->speeds.speed_mps * arc->speeds.turn_radps);
    stretch.until_s = arc->end_s;
  }
  return stretch;
}

double MovingRobot::fastest_mps() const {
  return engine_body ? std::hypot(motion_.x_mps, motion_.y_mps) : stopped_s_ ? 0 : fastest_mps_;
}

bool MovingRobot::stands() const { return !engine_body && (arcs_.empty() || stopped_s_); }

void MovingRobot::stop(double time_s) {
  assert(!stands());
  if (turns_on_the_spot()) return pin(time_s);
  pose_ = pose_at(time_s);
  stopped_s_ = time_s;
}

bool MovingRobot::turns_on_the_spot() const {
  return left_.command_radps == -right_.command_radps && left_.begin_radps == -right_.begin_radps;
}

void MovingRobot::pin(double time_s) {
  const Pose2 there = pose_at(time_s);
  const auto next = std::upper_bound(arcs_.begin(), arcs_.end(), time_s,
                                     [](double time, const Arc& arc) { return time < arc.begin_s; });
  const std::ptrdiff_t first = std::max<std::ptrdiff_t>(next - arcs_.begin() - 1, 0);
  if (arcs_[first].begin_s < time_s) {
    const double end_s = std::exchange(arcs_[first].end_s, time_s);
    arcs_.insert(next, {time_s, end_s, there, arcs_[first].speeds});
  }
  pose_ = there;
  for (Arc& arc : arcs_) {
    if (arc.begin_s < time_s) continue;
    arc.from = pose_;
    arc.speeds.speed_mps = 0;
    pose_ = advance(pose_, arc.speeds, arc.end_s - arc.begin_s);
  }
}

void MovingRobot::be_moved(double to_s, const PhysicsEngine::Motion& motion) {
  motion_ = motion;
  pose_ = motion.pose;
  waypoints_.push_back({to_s, pose_});
}

void MovingRobot::end_step() {
  const double turned_s = stopped_s_.value_or(step_s_);
  turned_.left_rad += left_.turned_rad(turned_s);
  turned_.right_rad += right_.turned_rad(turned_s);
  lagging_ = stopped_s_ ? WheelSpeeds{} : WheelSpeeds{left_.speed_radps(step_s_), right_.speed_radps(step_s_)};
  left_slip_.advance(step_s_);
  right_slip_.advance(step_s_);
}

}  // namespace twocone::sim_povray
