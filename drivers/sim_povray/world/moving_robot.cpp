// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "drivers/sim_povray/session_settings.h"

namespace twocone::sim_povray {

void StepPath::begin_at(const Pose2& here, std::chrono::nanoseconds step) {
  span = step;
  begin = end = here;
  arcs.clear();
  waypoints.clear();
  stopped_s.reset();
}

const StepPath::Arc* StepPath::arc_at(double time_s) const {
  if (stopped_s && time_s >= *stopped_s) return nullptr;
  const auto next = std::ranges::upper_bound(arcs, time_s, {}, &Arc::begin_s);
  if (next == arcs.begin() || time_s >= std::prev(next)->end_s) return nullptr;
  return &*std::prev(next);
}

Pose2 StepPath::pose_at(double time_s) const {
  if (!waypoints.empty()) {
    const auto next = std::ranges::upper_bound(waypoints, time_s, {}, &Waypoint::time_s);
    if (next == waypoints.end()) return end;
    if (next == waypoints.begin()) return begin;
    const Waypoint& from = *std::prev(next);
    const double share = (time_s - from.time_s) / (next->time_s - from.time_s);
    return {from.pose.x_m + share * (next->pose.x_m - from.pose.x_m),
            from.pose.y_m + share * (next->pose.y_m - from.pose.y_m),
            wrap_angle(from.pose.heading_rad + share * wrap_angle(next->pose.heading_rad - from.pose.heading_rad))};
  }
  if (arcs.empty() || time_s <= arcs.front().begin_s) return begin;
  const Arc* arc = arc_at(time_s);
  if (arc == nullptr) return end;
  return time_s == arc->begin_s ? arc->from : advance(arc->from, arc->speeds, time_s - arc->begin_s);
}

MovingRobot::MovingRobot(const RobotBody& body)
    : body_(body),
      left_slip_(body.wheels.slip, body.wheels.slip_correlation_s, engine_for(body.seed, Purpose::kLeftSlip)),
      right_slip_(body.wheels.slip, body.wheels.slip_correlation_s, engine_for(body.seed, Purpose::kRightSlip)) {
  path_.begin_at(wrapped(body.begin.value_or(body.start)), std::chrono::nanoseconds(0));
}

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
  // The time is computed as a difference, because now + timeout would overflow for a time-out of centuries.
  const auto alive = std::max(body_.command_timeout - (now - commanded_at_), std::chrono::nanoseconds(0));
  const double driven_s = seconds(std::min(alive, span));
  const double lag_s = body_.wheels.lag_s;
  step_s_ = seconds(span);
  left_ = {lagging_.left_radps, command_.left_radps, driven_s, lag_s};
  right_ = {lagging_.right_radps, command_.right_radps, driven_s, lag_s};
  begin_path(span);
  fastest_mps_ = 0;
  if (engine_body) {
    path_.waypoints.push_back({0, path_.end});
  } else if (lag_s == 0) {
    if (command_ != WheelSpeeds{} && driven_s > 0) {
      add_arc(0, driven_s, on_floor(command_.left_radps, command_.right_radps));
    }
  } else {
    add_lagging_arcs(0, driven_s);
    add_lagging_arcs(driven_s, step_s_);
  }
}

void MovingRobot::begin_path(std::chrono::nanoseconds span) {
  constexpr auto kKept = std::chrono::nanoseconds(std::int64_t(kMaxStampLate_s * 1e9));
  const Pose2 here = path_.end;
  past_span_ += path_.span;
  past_.push_front(std::move(path_));
  path_ = {};
  while (past_span_ - past_.back().span >= kKept) {
    past_span_ -= past_.back().span;
    path_ = std::move(past_.back());  // reuses its memory
    past_.pop_back();
  }
  path_.begin_at(here, span);
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
  path_.arcs.push_back({begin_s, end_s, path_.end, speeds});
  path_.end = advance(path_.end, speeds, end_s - begin_s);
  fastest_mps_ = std::max(fastest_mps_, std::abs(speeds.speed_mps));
}

void MovingRobot::add_lagging_arcs(double begin_s, double end_s) {
  if (end_s <= begin_s) return;
  const double driven = begin_s < left_.driven_s ? 1 : 0;
  const WheelSpeeds to{driven * command_.left_radps, driven * command_.right_radps};
  const int pieces = int(std::ceil((end_s - begin_s) / kLagArc_s));
  double from_s = begin_s;
  for (int i = 1; i <= pieces; ++i) {
    if (WheelSpeeds{left_.speed_radps(from_s), right_.speed_radps(from_s)} == to) {  // the remainder is one arc
      if (to != WheelSpeeds{}) add_arc(from_s, end_s, on_floor(to.left_radps, to.right_radps));
      return;
    }
    const double to_s = i == pieces ? end_s : begin_s + (end_s - begin_s) * i / pieces;
    add_arc(from_s, to_s, rim_speeds(from_s, to_s));
    from_s = to_s;
  }
}

Pose2 MovingRobot::pose_before(std::chrono::nanoseconds before) const {
  if (before <= before.zero()) return path_.end;
  const StepPath* path = &path_;
  for (const StepPath& past : past_) {
    if (before <= path->span) break;
    before -= path->span;
    path = &past;
  }
  return path->pose_at(std::max(seconds(path->span) - seconds(before), 0.0));
}

Stretch MovingRobot::stretch(double time_s) const {
  if (engine_body) {
    const double since_s = time_s - path_.waypoints.back().time_s;
    return {{path_.end.x_m + since_s * motion_.x_mps, path_.end.y_m + since_s * motion_.y_mps},
            motion_.x_mps,
            motion_.y_mps};
  }
  const Pose2 at = path_.pose_at(time_s);
  Stretch stretch{{at.x_m, at.y_m}};
  if (const StepPath::Arc* arc = path_.arc_at(time_s)) {
    stretch.x_mps = arc->speeds.speed_mps * std::cos(at.heading_rad);
    stretch.y_mps = arc->speeds.speed_mps * std::sin(at.heading_rad);
    stretch.bend_mps2 = std::abs(arc->speeds.speed_mps * arc->speeds.turn_radps);
    stretch.until_s = arc->end_s;
  }
  return stretch;
}

double MovingRobot::fastest_mps() const {
  return engine_body ? std::hypot(motion_.x_mps, motion_.y_mps) : path_.stopped_s ? 0 : fastest_mps_;
}

bool MovingRobot::stands() const { return !engine_body && (path_.arcs.empty() || path_.stopped_s); }

void MovingRobot::stop(double time_s) {
  assert(!stands());
  if (turns_on_the_spot()) return pin(time_s);
  path_.end = path_.pose_at(time_s);
  path_.stopped_s = time_s;
}

bool MovingRobot::turns_on_the_spot() const {
  return left_.command_radps == -right_.command_radps && left_.begin_radps == -right_.begin_radps;
}

void MovingRobot::pin(double time_s) {
  const Pose2 there = path_.pose_at(time_s);
  const auto next = std::ranges::upper_bound(path_.arcs, time_s, {}, &StepPath::Arc::begin_s);
  const std::ptrdiff_t first = std::max<std::ptrdiff_t>(next - path_.arcs.begin() - 1, 0);
  if (path_.arcs[first].begin_s < time_s) {
    const double end_s = std::exchange(path_.arcs[first].end_s, time_s);
    path_.arcs.insert(next, {time_s, end_s, there, path_.arcs[first].speeds});
  }
  path_.end = there;
  for (StepPath::Arc& arc : path_.arcs) {
    if (arc.begin_s < time_s) continue;
    arc.from = path_.end;
    arc.speeds.speed_mps = 0;
    path_.end = advance(path_.end, arc.speeds, arc.end_s - arc.begin_s);
  }
}

void MovingRobot::be_moved(double to_s, const PhysicsEngine::Motion& motion) {
  motion_ = motion;
  path_.end = motion.pose;
  path_.waypoints.push_back({to_s, path_.end});
}

void MovingRobot::end_step() {
  const double turned_s = path_.stopped_s.value_or(step_s_);
  turned_.left_rad += left_.turned_rad(turned_s);
  turned_.right_rad += right_.turned_rad(turned_s);
  lagging_ = path_.stopped_s ? WheelSpeeds{} : WheelSpeeds{left_.speed_radps(step_s_), right_.speed_radps(step_s_)};
  left_slip_.advance(step_s_);
  right_slip_.advance(step_s_);
}

}  // namespace twocone::sim_povray
