// SPDX-License-Identifier: Apache-2.0
#include "apps/behaviours/explore.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

namespace twocone::behaviours {
namespace {

constexpr double kFirst_m = 0.3;      // of a way, for the direction in which it begins
constexpr double kLittle_m = 0.11;    // of the margin that may be missing while the robot drives on
constexpr double kLookAhead_m = 0.8;  // longest straight part of the way to steer for
// `towards` drives slowly to a near place, so no place of the way is nearer, even if the way to it is not straight.
constexpr double kLeastAhead_m = 0.3;
constexpr double kClear_m = 0.10;      // beyond the distance that is driven until the wheels can react
constexpr double kApproach_mps = 0.3;  // of things that move
constexpr double kAside_m = 0.35;      // kept to what has come, which may come nearer
// A thing has come if so many beams end at it, this near to each other, because one may be wrong. It counts this near
// to the robot, and for so many scans: nearer than 0.5 m no mirror shows it any more.
constexpr int kLeastBeams = 5;
constexpr double kThing_m = 0.25;
constexpr double kNear_m = 1.2;
constexpr std::size_t kRemembered = 15;
// It is expected to go on as far as it went in these scans, and twice as far. The nearest thing this many scans ago,
// within this distance, was the same.
constexpr std::size_t kWatched = 5;
constexpr double kSameThing_m = 0.4;
// At first the robot stands still for so many scans: by three of them floor is free, and by the others it sees what
// moves.
constexpr std::size_t kFirstScans = 8;
// Where a thing has gone away, it may come back: for so many scans nothing is entered there.
constexpr std::uint64_t kBusy = 75;
// A goal is given up for another that shows so many times as much per second.
constexpr double kBetter = 1.5;
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

}  // namespace

/// The shortest ways from one cell.
struct Explore::Ways {
  std::vector<double> cost_m;  ///< by cell, infinite where there is no way
  std::vector<std::size_t> before;
  std::vector<double> new_m;           ///< length of the way, each part by its share of new floor
  std::vector<std::size_t> direction;  ///< cell of the way, kFirst_m from its begin
};

Explore::Explore(const Body& body, const Arena& arena, LowestSeen lowest_seen_m, double reaction_s)
    : body_(body), reaction_s_(reaction_s), floor_(arena, std::move(lowest_seen_m)), is_visited_(floor_.cells()) {}

void Explore::see(const localisation::Pose& at, const std::vector<vision::Beam>& scan) {
  std::vector<Eigen::Vector2d> seen_m = floor_.add(at, scan);
  const Eigen::Vector2d here_m(at.x_m, at.y_m);
  std::erase_if(seen_m, [&](const Eigen::Vector2d& thing_m) { return (thing_m - here_m).norm() > kNear_m; });
  std::erase_if(seen_m, [all = seen_m](const Eigen::Vector2d& thing_m) {
    return std::ranges::count_if(all, [&](const Eigen::Vector2d& other_m) {
             return (other_m - thing_m).norm() < kThing_m;
           }) < kLeastBeams;
  });
  std::vector<Eigen::Vector2d> expected_m = expected(seen_m);
  come_.push_back({std::move(seen_m), std::move(expected_m)});
  if (come_.size() > kRemembered) come_.pop_front();
}

std::vector<Eigen::Vector2d> Explore::expected(const std::vector<Eigen::Vector2d>& seen_m) const {
  if (come_.size() < kWatched) return {};
  const std::vector<Eigen::Vector2d>& before_m = come_[come_.size() - kWatched].seen_m;
  if (before_m.empty()) return {};
  std::vector<Eigen::Vector2d> expected_m;
  for (const Eigen::Vector2d& now_m : seen_m) {
    const Eigen::Vector2d then_m = *std::ranges::min_element(
        before_m, {}, [&](const Eigen::Vector2d& thing_m) { return (thing_m - now_m).squaredNorm(); });
    const Eigen::Vector2d moved_m = now_m - then_m;
    if (moved_m.norm() > kSameThing_m) continue;
    expected_m.insert(expected_m.end(), {now_m + moved_m, now_m + 2 * moved_m});
  }
  return expected_m;
}

std::vector<float> Explore::new_floor() const {
  const auto per_cell =
      static_cast<float>(SeenFloor::kCell_m * SeenFloor::kCell_m / (std::numbers::pi * kVisited_m * kVisited_m));
  std::vector<float> share(floor_.cells());
  for (std::size_t cell = 0; cell < floor_.cells(); ++cell) {
    if (is_visited_[cell] != 0 || !floor_.is_free(cell)) continue;
    floor_.within(floor_.middle_m(cell), kVisited_m, [&](std::size_t near) { share[near] += per_cell; });
  }
  return share;
}

Explore::Ways Explore::ways_from(std::size_t here) const {
  Ways ways{std::vector<double>(floor_.cells(), std::numeric_limits<double>::infinity()),
            std::vector<std::size_t>(floor_.cells(), kNone), std::vector<double>(floor_.cells()),
            std::vector<std::size_t>(floor_.cells(), kNone)};
  const std::vector<float> new_share = new_floor();
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  ways.cost_m[here] = 0;
  open.emplace(0, here);
  const auto columns = std::ptrdiff_t(floor_.columns());
  const std::array steps{std::pair{std::ptrdiff_t(1), 1.0},
                         std::pair{std::ptrdiff_t(-1), 1.0},
                         std::pair{columns, 1.0},
                         std::pair{-columns, 1.0},
                         std::pair{columns + 1, std::numbers::sqrt2},
                         std::pair{columns - 1, std::numbers::sqrt2},
                         std::pair{-columns + 1, std::numbers::sqrt2},
                         std::pair{-columns - 1, std::numbers::sqrt2}};
  while (!open.empty()) {
    const auto [cost_m, cell] = open.top();
    open.pop();
    if (cost_m > ways.cost_m[cell]) continue;
    // Cells of the border have no room, so each cell on a way has eight neighbours.
    for (const auto& [step, length] : steps) {
      const std::ptrdiff_t next = std::ptrdiff_t(cell) + step;
      if (room_[std::size_t(next)] == 0) continue;
      const double there_m =
          cost_m + length * SeenFloor::kCell_m * (is_easy_[std::size_t(next)] != 0 ? 1 : kUneasyCost);
      if (there_m >= ways.cost_m[std::size_t(next)]) continue;
      ways.cost_m[std::size_t(next)] = there_m;
      ways.before[std::size_t(next)] = cell;
      ways.new_m[std::size_t(next)] =
          ways.new_m[cell] + length * SeenFloor::kCell_m * double(new_share[std::size_t(next)]);
      ways.direction[std::size_t(next)] = cost_m < kFirst_m ? std::size_t(next) : ways.direction[cell];
      open.emplace(there_m, std::size_t(next));
    }
  }
  return ways;
}

bool Explore::is_straight_way(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const {
  const int steps = std::max(1, static_cast<int>(std::ceil((to_m - from_m).norm() / (SeenFloor::kCell_m / 2))));
  for (int k = 1; k <= steps; ++k) {
    if (room_[floor_.cell_of(from_m + (to_m - from_m) * k / steps)] == 0) return false;
  }
  return true;
}

double Explore::time_s(const localisation::Pose& from, const Eigen::Vector2d& first_m, double way_m) const {
  const Eigen::Vector2d first = localisation::in_body(from, first_m);
  const double turn_s = std::atan2(std::abs(first.y()), std::abs(first.x())) / turn_rate_on_the_spot(body_);
  return turn_s + way_m / (Wander::kForward * body_.max_speed_mps);
}

std::optional<Eigen::Vector2d> Explore::nearest_room(const localisation::Pose& from) const {
  std::optional<Eigen::Vector2d> nearest_m;
  double least_s = std::numeric_limits<double>::infinity();
  for (std::size_t cell = 0; cell < floor_.cells(); ++cell) {
    if (room_[cell] == 0) continue;
    const Eigen::Vector2d middle_m = floor_.middle_m(cell);
    const double to_s = time_s(from, middle_m, localisation::in_body(from, middle_m).norm());
    if (to_s >= least_s) continue;
    least_s = to_s;
    nearest_m = middle_m;
  }
  return nearest_m;
}

std::optional<Eigen::Vector2d> Explore::next_place(const localisation::Pose& believed) {
  const Eigen::Vector2d here_m(believed.x_m, believed.y_m);
  // Something has come, or was found, closer than the margin: by more than a little, the robot leaves it first.
  auto from_m = room_[floor_.cell_of(here_m)] != 0 ? std::optional(here_m) : nearest_room(believed);
  if (!from_m || (*from_m - here_m).norm() > kLittle_m) return from_m;
  const std::size_t here = floor_.cell_of(*from_m);
  const Ways ways = ways_from(here);
  const auto can_be_goal = [&](std::size_t cell) {
    return is_visited_[cell] == 0 && room_[cell] != 0 && std::isfinite(ways.cost_m[cell]);
  };
  const auto new_mps = [&](std::size_t cell) {
    return ways.new_m[cell] / time_s(believed, floor_.middle_m(ways.direction[cell]), ways.cost_m[cell]);
  };
  if (goal_ && !can_be_goal(*goal_)) goal_.reset();
  double best_mps = goal_ ? kBetter * new_mps(*goal_) : 0;
  for (std::size_t cell = 0; cell < floor_.cells(); ++cell) {
    if (!can_be_goal(cell)) continue;
    if (const double mps = new_mps(cell); mps > best_mps) {
      best_mps = mps;
      goal_ = cell;
    }
  }
  if (!goal_) return std::nullopt;
  std::vector<std::size_t> way;
  for (std::size_t cell = *goal_; cell != here; cell = ways.before[cell]) way.push_back(cell);
  std::ranges::reverse(way);
  Eigen::Vector2d place_m = floor_.middle_m(way.front());
  for (const std::size_t cell : way) {
    const Eigen::Vector2d middle_m = floor_.middle_m(cell);
    const double ahead_m = (middle_m - *from_m).norm();
    if (ahead_m > kLookAhead_m || (ahead_m > kLeastAhead_m && !is_straight_way(*from_m, middle_m))) break;
    place_m = middle_m;
  }
  return place_m;
}

bool Explore::is_blocked(const localisation::Pose& believed) const {
  const Eigen::Vector2d here_m(believed.x_m, believed.y_m);
  const Eigen::Vector2d forward(std::cos(believed.heading_rad), std::sin(believed.heading_rad));
  const double speed_mps = Wander::kForward * body_.max_speed_mps;
  // What is too near already must not come nearer; the robot may drive away from it.
  const int not_free = floor_.not_free_within(here_m, body_.radius_m);
  const double way_m = speed_mps * reaction_s_ + kClear_m;
  for (int k = 1; k * SeenFloor::kCell_m < way_m; ++k) {
    if (floor_.not_free_within(here_m + k * SeenFloor::kCell_m * forward, body_.radius_m) > not_free) return true;
  }
  // What has just come may come nearer.
  const Eigen::Vector2d meets_m = here_m + (way_m + kApproach_mps * reaction_s_) * forward;
  const auto is_met = [&](const Eigen::Vector2d& thing_m) {
    const Eigen::Vector2d aside_m = thing_m - here_m;
    const double along_m = std::clamp(aside_m.dot(forward), 0.0, (meets_m - here_m).norm());
    return (aside_m - along_m * forward).norm() < body_.radius_m + kMargin_m;
  };
  return !come_.empty() &&
         (std::ranges::any_of(come_.back().seen_m, is_met) || std::ranges::any_of(come_.back().expected_m, is_met));
}

Motion Explore::decide(const localisation::Pose& believed, double /*step_s*/) {
  if (come_.size() < kFirstScans) return {};
  const Eigen::Vector2d here_m(believed.x_m, believed.y_m);
  floor_.stand_on(here_m, body_.radius_m);
  room_ = floor_.room_for(body_.radius_m + kMargin_m);
  const auto keep_aside = [&](const Eigen::Vector2d& thing_m) {
    floor_.within(thing_m, body_.radius_m + kAside_m, [&](std::size_t cell) { room_[cell] = 0; });
  };
  for (const Come& come : come_) {
    std::ranges::for_each(come.seen_m, keep_aside);
    std::ranges::for_each(come.expected_m, keep_aside);
  }
  for (std::size_t cell = 0; cell < floor_.cells(); ++cell) {
    if (!floor_.was_busy_within(cell, kBusy)) continue;
    floor_.within(floor_.middle_m(cell), body_.radius_m + kMargin_m, [&](std::size_t near) { room_[near] = 0; });
  }
  is_easy_ = floor_.room_for(body_.radius_m + kComfort_m);
  for (std::size_t cell = 0; cell < floor_.cells(); ++cell) {
    if (!floor_.is_well_seen(cell) || floor_.is_busy(cell)) is_easy_[cell] = 0;
    if ((floor_.middle_m(cell) - here_m).norm() < kVisited_m) is_visited_[cell] = 1;
  }
  auto place_m = next_place(believed);
  if (!place_m) {
    std::ranges::fill(is_visited_, std::uint8_t{0});  // all of it was visited: once more
    place_m = next_place(believed);
  }
  if (!place_m) return {};
  // The mirrors show as much behind the robot as before it: it drives that way round which needs the smaller turn.
  localisation::Pose driven = believed;
  const bool is_behind = localisation::in_body(believed, *place_m).x() < 0;
  if (is_behind) driven.heading_rad = localisation::wrap_angle_rad(believed.heading_rad + std::numbers::pi);
  Motion motion = towards(body_, driven, *place_m, is_blocked(driven));
  if (is_behind) motion.speed_mps = -motion.speed_mps;
  return motion;
}

}  // namespace twocone::behaviours
