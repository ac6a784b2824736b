// SPDX-License-Identifier: Apache-2.0
#include "apps/behaviours/behaviour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/random.h"

namespace twocone::behaviours {
namespace {

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - (a + t * along)).norm();
}

/// Returns the signed distance to the outline, negative inside. The even-odd rule defines the inside.
double distance_to_outline(const Eigen::Vector2d& p, const Outline& outline) {
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Eigen::Vector2d& a = outline[j];
    const Eigen::Vector2d& b = outline[i];
    nearest = std::min(nearest, distance_to_segment(p, a, b));
    const bool crosses = (a.y() > p.y()) != (b.y() > p.y());
    if (crosses && p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) inside = !inside;
  }
  return inside ? -nearest : nearest;
}

}  // namespace

double turn_rate_on_the_spot(const Body& body) {
  return 2 * Wander::kTurning * body.max_speed_mps / body.wheel_separation_m;
}

double Arena::clearance_m(const Eigen::Vector2d& p_m) const {
  double least = std::min((p_m - min_m).minCoeff(), (max_m - p_m).minCoeff());
  for (const Outline& outline : outlines) least = std::min(least, distance_to_outline(p_m, outline));
  for (const Disc& disc : discs) {
    const Eigen::Vector2d centre_m(disc.centre.x_m, disc.centre.y_m);
    least = std::min(least, (p_m - centre_m).norm() - disc.radius_m);
  }
  return least;
}

Motion towards(const Body& body, const localisation::Pose& believed, const Eigen::Vector2d& place_m, bool is_blocked) {
  constexpr double kTurnOnTheSpot_rad = 0.5;
  constexpr double kSteering_1ps = 1.5;  // turn rate per radian of error
  const Eigen::Vector2d to_go = place_m - Eigen::Vector2d(believed.x_m, believed.y_m);
  const double error_rad = localisation::wrap_angle_rad(std::atan2(to_go.y(), to_go.x()) - believed.heading_rad);
  const double most_radps = turn_rate_on_the_spot(body);
  const double turn_radps = std::clamp(kSteering_1ps * error_rad, -most_radps, most_radps);
  if (std::abs(error_rad) > kTurnOnTheSpot_rad) return {0, std::copysign(most_radps, error_rad)};
  if (is_blocked) return {0, turn_radps};
  // The robot drives slowly near the place; otherwise it could pass it before the turn is complete.
  return {std::min(Wander::kForward * body.max_speed_mps, std::max(to_go.norm(), Waypoints::kReached_m)), turn_radps};
}

Motion Still::decide(const localisation::Pose& /*believed*/, double /*step_s*/) { return {}; }

Manual::Manual(const Body& body, std::function<Shares()> requested) : body_(body), requested_(std::move(requested)) {}

Motion Manual::decide(const localisation::Pose& /*believed*/, double /*step_s*/) {
  const auto limited = [](double share) { return std::isnan(share) ? 0.0 : std::clamp(share, -1.0, 1.0); };
  const Shares requested = requested_();
  const double speed = limited(requested.speed);
  const double turn = limited(requested.turn) * Wander::kTurning;
  const double fastest_wheel = std::max(1.0, std::abs(speed) + std::abs(turn));
  return {speed / fastest_wheel * body_.max_speed_mps,
          turn / fastest_wheel * 2 * body_.max_speed_mps / body_.wheel_separation_m};
}

Wander::Wander(const Body& body, Arena arena, std::uint64_t seed)
    : body_(body), arena_(std::move(arena)), discs_of_map_(arena_.discs.size()), random_(seed) {}

void Wander::avoid(const std::vector<Disc>& found) {
  arena_.discs.resize(discs_of_map_);
  arena_.discs.insert(arena_.discs.end(), found.begin(), found.end());
}

bool Wander::is_blocked(const localisation::Pose& believed) const {
  const Eigen::Vector2d here(believed.x_m, believed.y_m);
  const Eigen::Vector2d ahead =
      here + kLookAhead_m * Eigen::Vector2d(std::cos(believed.heading_rad), std::sin(believed.heading_rad));
  const double room_m = arena_.clearance_m(ahead);
  return room_m < body_.radius_m + kMargin_m && room_m < arena_.clearance_m(here);
}

Motion Wander::decide(const localisation::Pose& believed, double step_s) {
  turn_left_s_ = std::max(turn_left_s_ - step_s, 0.0);
  if (turn_left_s_ == 0) {
    if (!is_blocked(believed)) {
      side_ = 0;
      return {kForward * body_.max_speed_mps, 0};
    }
    if (side_ == 0) side_ = base::fraction(random_) < 0.5 ? 1 : -1;
    turn_left_s_ = kShortestTurn_s + (kLongestTurn_s - kShortestTurn_s) * base::fraction(random_);
  }
  return {0, side_ * turn_rate_on_the_spot(body_)};
}

Waypoints::Waypoints(const Body& body, std::vector<Eigen::Vector2d> points_m)
    : body_(body), points_m_(std::move(points_m)) {
  if (points_m_.empty()) throw std::invalid_argument("Waypoints: no points to drive to");
}

Motion Waypoints::decide(const localisation::Pose& believed, double /*step_s*/) {
  const Eigen::Vector2d here(believed.x_m, believed.y_m);
  if ((points_m_[next_] - here).norm() < kReached_m) next_ = (next_ + 1) % points_m_.size();
  return towards(body_, believed, points_m_[next_], false);
}

}  // namespace twocone::behaviours
