// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace twocone::sim_povray {
World::World(const PlaceSettings& place) : surroundings_(place) {
  for (const MovingThing& m : place.moving) {
    things_.push_back({"moving." + m.name, MovingPath(m), m.speed_mps, m.radius_m});
  }
}

void World::step() {
  assert(rate_hz_ > 0);
  const std::chrono::nanoseconds next =
      base_ + std::chrono::nanoseconds(std::llround(double(step_number_ + 1 - base_step_) * 1e9 / rate_hz_));
  const double step_s = seconds(next - now_);
  for (auto& [id, robot] : robots_) robot.begin_step(now_, next - now_);
  const bool physics =
      std::ranges::any_of(robots_, [](const auto& entry) { return entry.second.engine_body.has_value(); });
  if (physics) {
    move_by_physics(step_s);
  } else {
    move_freely(0, step_s);
  }
  for (auto& [id, robot] : robots_) robot.end_step();
  now_ = next;
  ++step_number_;
  for (auto& [id, robot] : robots_) update_contact(robot);
}

void World::note(const Touch& touch, MovingRobot& a, const std::string& name_of_b, MovingRobot* b) {
  if (touch.at_s > earliest_s_) return;
  if (touch.at_s < earliest_s_) stops_.clear();
  earliest_s_ = touch.at_s;
  if (touch.a_approaches) stops_.push_back({&a, &name_of_b});
  if (touch.b_approaches) stops_.push_back({b, &a.name()});
}

void World::find_touches(RobotId id, MovingRobot& robot, double from_s, double to_s) {
  const auto stretch = [&robot](double time_s) { return robot.stretch(time_s); };
  const auto look_at = [&](const std::string& name, const auto& stretch_of_it, const auto& face, double its_mps,
                           MovingRobot* other, bool can_stop) {
    const auto touch = first_touch(stretch, robot.radius_m(), stretch_of_it, face, can_stop,
                                   robot.fastest_mps() + its_mps, from_s, to_s);
    if (touch) note(*touch, robot, name, other);
  };
  const auto disc_of = [](double radius_m) {
    return [radius_m](const FloorPoint& at, const FloorPoint& point) { return facing(Disc{at, radius_m}, point); };
  };
  if (!robot.stands()) {
    const auto standing = [](double) { return Stretch{}; };
    for (const Part& part : surroundings_.parts()) {
      const auto face = [&part](const FloorPoint&, const FloorPoint& point) { return facing(part, point); };
      look_at(surroundings_.name(part), standing, face, 0, nullptr, false);
    }
    const double begin_s = seconds(now_);
    for (const Thing& thing : things_) {
      const auto on_rails = [&thing, begin_s](double time_s) {
        Stretch s = thing.path.stretch(begin_s + time_s);
        s.until_s -= begin_s;
        return s;
      };
      look_at(thing.name, on_rails, disc_of(thing.radius_m), thing.speed_mps, nullptr, false);
    }
  }
  for (auto& entry : robots_) {
    const RobotId other_id = entry.first;
    auto& other = entry.second;  // no structured binding, which clang 14 does not capture
    const bool on_rails = other.engine_body.has_value();
    if (other_id == id || other.radius_m() == 0) continue;
    // A pair of robots that can both be stopped is checked once, from the same side whichever joined first.
    if (!on_rails && std::tie(other.name(), other_id) < std::tie(robot.name(), id)) continue;
    if (robot.stands() && other.stands()) continue;
    const auto other_stretch = [&other](double time_s) { return other.stretch(time_s); };
    look_at(other.name(), other_stretch, disc_of(other.radius_m()), other.fastest_mps(), &other, !on_rails);
  }
}

void World::move_freely(double from_s, double to_s) {
  for (;;) {
    earliest_s_ = std::numeric_limits<double>::infinity();
    stops_.clear();
    for (auto& [id, robot] : robots_) {
      if (robot.radius_m() > 0 && !robot.engine_body) find_touches(id, robot, from_s, to_s);
    }
    if (stops_.empty()) return;
    // Several touches at one moment: the alphabetically first name counts, whichever robot joined first.
    std::sort(stops_.begin(), stops_.end(), [](const Stop& a, const Stop& b) { return *a.by < *b.by; });
    for (auto stop = stops_.begin(); stop != stops_.end(); ++stop) {
      const auto is_same = [stop](const Stop& earlier) { return earlier.robot == stop->robot; };
      if (std::any_of(stops_.begin(), stop, is_same)) continue;
      stop->robot->stop(earliest_s_);
      stop->robot->contact = *stop->by;
    }
    from_s = earliest_s_;
  }
}

void World::move_by_physics(double step_s) {
  const int pieces = std::max(1, int(std::ceil(step_s / PhysicsEngine::kStep_s)));
  const double begin_s = seconds(now_);
  double from_s = 0;
  for (int i = 1; i <= pieces; ++i) {
    const double to_s = i == pieces ? step_s : step_s * i / pieces;
    const double dt_s = to_s - from_s;
    move_freely(from_s, to_s);
    drives_.clear();
    movers_.clear();
    const auto add_mover = [this, dt_s](const FloorPoint& from, const FloorPoint& to, double radius_m) {
      movers_.push_back({from, (to.x_m - from.x_m) / dt_s, (to.y_m - from.y_m) / dt_s, radius_m});
    };
    for (auto& [id, robot] : robots_) {
      if (robot.engine_body) {
        drives_.push_back({*robot.engine_body, robot.rim_speeds(from_s, to_s)});
      } else if (robot.radius_m() > 0) {
        add_mover(robot.stretch(from_s).at, robot.stretch(to_s).at, robot.radius_m());
      }
    }
    for (const Thing& thing : things_) {
      add_mover(thing.path.stretch(begin_s + from_s).at, thing.path.stretch(begin_s + to_s).at, thing.radius_m);
    }
    engine_->step(dt_s, drives_, movers_, surroundings_.parts());
    for (auto& [id, robot] : robots_) {
      if (robot.engine_body) robot.be_moved(to_s, engine_->motion(*robot.engine_body));
    }
    from_s = to_s;
  }
}

template <typename Visit>
void World::visit_neighbours(const FloorPoint& at, double radius_m, const MovingRobot* self, const Visit& visit) const {
  for (const Part& part : surroundings_.parts()) {
    visit(surroundings_.name(part), facing(part, at).distance_m - radius_m);
  }
  for (const Thing& thing : things_) {
    const Disc disc{thing.path.stretch(seconds(now_)).at, thing.radius_m};
    visit(thing.name, facing(disc, at).distance_m - radius_m);
  }
  for (const auto& [id, other] : robots_) {
    if (&other == self || other.radius_m() == 0) continue;
    visit(other.name(), facing(Disc{other.place(), other.radius_m()}, at).distance_m - radius_m);
  }
}

void World::update_contact(MovingRobot& robot) const {
  if (robot.radius_m() == 0) return;
  double held_m = std::numeric_limits<double>::infinity();
  double nearest_m = robot.engine_body ? kGap_m : kTouch_m;
  const std::string* nearest = nullptr;
  visit_neighbours(robot.place(), robot.radius_m(), &robot, [&](const std::string& name, double gap_m) {
    if (name == robot.contact) held_m = std::min(held_m, gap_m);
    if (gap_m < nearest_m || (gap_m == nearest_m && (nearest == nullptr || name < *nearest))) {
      nearest_m = gap_m;
      nearest = &name;
    }
  });
  if (held_m <= kGap_m) return;
  robot.contact = nearest == nullptr ? std::string() : *nearest;
}

void World::set_rate(double rate_hz) {
  assert(rate_hz > 0);
  if (rate_hz == rate_hz_) return;
  rate_hz_ = rate_hz;
  base_step_ = step_number_;
  base_ = now_;
}

void World::begin_anew() {
  robots_.clear();
  next_robot_ = 0;
  engine_.reset();
  base_step_ = step_number_ = 0;
  base_ = now_ = std::chrono::nanoseconds(0);
}

Result<World::RobotId> World::add_robot(const RobotBody& robot) {
  const Pose2& begin = robot.begin ? *robot.begin : robot.start;
  const FloorPoint at{begin.x_m, begin.y_m};
  const std::string* touched = nullptr;
  if (robot.radius_m > 0) {
    touched = surroundings_.outline_around(at);
    double nearest_m = kTouch_m;
    visit_neighbours(at, robot.radius_m, nullptr, [&](const std::string& name, double gap_m) {
      if (gap_m > nearest_m) return;
      nearest_m = gap_m;
      touched = &name;
    });
  }
  if (touched != nullptr) {
    const std::string place = robot.start_place.empty() ? "" : robot.start_place + ": ";
    return Error{ErrorCode::kRefused,
                 place + (robot.begin ? "begin of " : "start of ") + robot.name + " touches " + *touched};
  }
  MovingRobot added(robot);
  if (robot.physics) {
    assert(robot.radius_m > 0);
    if (!engine_) {
      auto opened = PhysicsEngine::open();
      if (!opened) return opened.error();
      engine_ = std::move(*opened);
    }
    added.engine_body = engine_->add(robot, added.pose());
  }
  const RobotId id = next_robot_++;
  robots_.emplace(id, std::move(added));
  return id;
}

void World::abandon(RobotId robot) {
  MovingRobot& abandoned = robots_.at(robot);
  if (abandoned.engine_body) engine_->remove(*abandoned.engine_body);
  abandoned.abandon();
}

void World::remove(RobotId robot) {
  if (const auto body = robots_.at(robot).engine_body) engine_->remove(*body);
  robots_.erase(robot);
  for (auto& [id, other] : robots_) update_contact(other);
}

Pose2 World::moving_pose_before(std::size_t thing, std::chrono::nanoseconds before) const {
  assert(thing < things_.size());
  return things_[thing].path.pose(seconds(now_ - before));
}

double encoder_reading_rad(double turned_rad, int counts_per_turn) {
  if (counts_per_turn == 0) return turned_rad;
  constexpr double kTurn_rad = 2 * std::numbers::pi;
  return std::floor(turned_rad / kTurn_rad * counts_per_turn) / counts_per_turn * kTurn_rad;
}

}  // namespace twocone::sim_povray
