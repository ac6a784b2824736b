// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/world/world.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

#include "drivers/sim_povray/world/moving_path.h"
#include "drivers/sim_povray/world/moving_robot.h"
#include "drivers/sim_povray/world/physics.h"
#include "drivers/sim_povray/world/surroundings.h"
#include "drivers/sim_povray/world/touch.h"

namespace twocone::sim_povray {
namespace {

double seconds(std::chrono::nanoseconds span) { return std::chrono::duration<double>(span).count(); }

struct Thing {
  std::string name;
  MovingPath path;
  double speed_mps;
  double radius_m;
};

}  // namespace

struct World::Impl {
  explicit Impl(const PlaceSettings& place) : surroundings(place) {
    for (const MovingThing& m : place.moving) {
      things.push_back({"moving." + m.name, MovingPath(m), m.speed_mps, m.radius_m});
    }
  }

  [[nodiscard]] MovingRobot& at(RobotId robot) {
    const auto found = robots.find(robot);
    assert(found != robots.end());
    return found->second;
  }

  void step();
  /// Moves the robots without physics, each up to where its first touch stops it.
  void move_freely(double from_s, double to_s);
  void move_by_physics(double step_s);
  void update_contact(MovingRobot& robot) const;
  /// Calls visit(name, gap in m) for each object around a point now, except for `self`.
  template <typename Visit>
  void visit_neighbours(const FloorPoint& at, double radius_m, const MovingRobot* self, const Visit& visit) const;

  /// A robot to be stopped at the earliest touch, and the name of the object that stops it.
  struct Stop {
    MovingRobot* robot;
    const std::string* by;
  };
  void note(const Touch& touch, MovingRobot& a, const std::string& name_of_b, MovingRobot* b);
  void find_touches(RobotId id, MovingRobot& robot, double from_s, double to_s);

  Surroundings surroundings;
  std::vector<Thing> things;
  std::map<RobotId, MovingRobot> robots;
  RobotId next_robot = 0;
  std::unique_ptr<PhysicsEngine> engine;

  double rate_hz = 0;
  std::uint64_t base_step = 0;
  std::chrono::nanoseconds base{0};
  std::uint64_t step_number = 0;
  std::chrono::nanoseconds now{0};

  // Stored from step to step to reuse their memory.
  double earliest_s = 0;
  std::vector<Stop> stops;
  std::vector<PhysicsEngine::Drive> drives;
  std::vector<PhysicsEngine::Mover> movers;
};

void World::Impl::step() {
  assert(rate_hz > 0);
  const std::chrono::nanoseconds next =
      base + std::chrono::nanoseconds(std::llround(double(step_number + 1 - base_step) * 1e9 / rate_hz));
  const double step_s = seconds(next - now);
  for (auto& [id, robot] : robots) robot.begin_step(now, next - now);
  const bool physics =
      std::any_of(robots.begin(), robots.end(), [](const auto& entry) { return entry.second.engine_body.has_value(); });
  if (physics) {
    move_by_physics(step_s);
  } else {
    move_freely(0, step_s);
  }
  for (auto& [id, robot] : robots) robot.end_step();
  now = next;
  ++step_number;
  for (auto& [id, robot] : robots) update_contact(robot);
}

void World::Impl::note(const Touch& touch, MovingRobot& a, const std::string& name_of_b, MovingRobot* b) {
  if (touch.at_s > earliest_s) return;
  if (touch.at_s < earliest_s) stops.clear();
  earliest_s = touch.at_s;
  if (touch.a_approaches) stops.push_back({&a, &name_of_b});
  if (touch.b_approaches) stops.push_back({b, &a.name()});
}

void World::Impl::find_touches(RobotId id, MovingRobot& robot, double from_s, double to_s) {
  const auto stretch = [&robot](double time_s) { return robot.stretch(time_s); };
  const double radius_m = robot.radius_m();
  if (!robot.stands()) {
    const auto standing = [](double) { return Stretch{}; };
    for (const Part& part : surroundings.parts()) {
      const auto face = [&part](const FloorPoint&, const FloorPoint& point) { return facing(part, point); };
      const auto touch = first_touch(stretch, radius_m, standing, face, false, robot.fastest_mps(), from_s, to_s);
      if (touch) note(*touch, robot, surroundings.name(part), nullptr);
    }
    const double begin_s = seconds(now);
    for (const Thing& thing : things) {
      const auto on_rails = [&thing, begin_s](double time_s) {
        Stretch s = thing.path.stretch(begin_s + time_s);
        s.until_s -= begin_s;
        return s;
      };
      const auto face = [&thing](const FloorPoint& at, const FloorPoint& point) {
        return facing(Disc{at, thing.radius_m}, point);
      };
      const double fastest_mps = robot.fastest_mps() + thing.speed_mps;
      const auto touch = first_touch(stretch, radius_m, on_rails, face, false, fastest_mps, from_s, to_s);
      if (touch) note(*touch, robot, thing.name, nullptr);
    }
  }
  for (auto& entry : robots) {
    const RobotId other_id = entry.first;
    auto& other = entry.second;  // no structured binding, which clang 14 does not capture
    const bool on_rails = other.engine_body.has_value();
    if (other_id == id || other.radius_m() == 0) continue;
    // A pair of robots that can both be stopped is checked once, from the same side whichever joined first.
    if (!on_rails && std::tie(other.name(), other_id) < std::tie(robot.name(), id)) continue;
    if (robot.stands() && other.stands()) continue;
    const auto other_stretch = [&other](double time_s) { return other.stretch(time_s); };
    const auto face = [&other](const FloorPoint& at, const FloorPoint& point) {
      return facing(Disc{at, other.radius_m()}, point);
    };
    const double fastest_mps = robot.fastest_mps() + other.fastest_mps();
    const auto touch = first_touch(stretch, radius_m, other_stretch, face, !on_rails, fastest_mps, from_s, to_s);
    if (touch) note(*touch, robot, other.name(), &other);
  }
}

void World::Impl::move_freely(double from_s, double to_s) {
  for (;;) {
    earliest_s = std::numeric_limits<double>::infinity();
    stops.clear();
    for (auto& [id, robot] : robots) {
      if (robot.radius_m() > 0 && !robot.engine_body) find_touches(id, robot, from_s, to_s);
    }
    if (stops.empty()) return;
    // Several touches at one moment: the alphabetically first name counts, whichever robot joined first.
    std::sort(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) { return *a.by < *b.by; });
    for (auto stop = stops.begin(); stop != stops.end(); ++stop) {
      const auto is_same = [stop](const Stop& earlier) { return earlier.robot == stop->robot; };
      if (std::any_of(stops.begin(), stop, is_same)) continue;
      stop->robot->stop(earliest_s);
      stop->robot->contact = *stop->by;
    }
    from_s = earliest_s;
  }
}

void World::Impl::move_by_physics(double step_s) {
  const int pieces = std::max(1, int(std::ceil(step_s / PhysicsEngine::kStep_s)));
  const double begin_s = seconds(now);
  double from_s = 0;
  for (int i = 1; i <= pieces; ++i) {
    const double to_s = i == pieces ? step_s : step_s * i / pieces;
    const double dt_s = to_s - from_s;
    move_freely(from_s, to_s);
    drives.clear();
    movers.clear();
    const auto add_mover = [this, dt_s](const FloorPoint& from, const FloorPoint& to, double radius_m) {
      movers.push_back({from, (to.x_m - from.x_m) / dt_s, (to.y_m - from.y_m) / dt_s, radius_m});
    };
    for (auto& [id, robot] : robots) {
      if (robot.engine_body) {
        drives.push_back({*robot.engine_body, robot.rim_speeds(from_s, to_s)});
      } else if (robot.radius_m() > 0) {
        add_mover(robot.stretch(from_s).at, robot.stretch(to_s).at, robot.radius_m());
      }
    }
    for (const Thing& thing : things) {
      add_mover(thing.path.stretch(begin_s + from_s).at, thing.path.stretch(begin_s + to_s).at, thing.radius_m);
    }
    engine->step(dt_s, drives, movers, surroundings.parts());
    for (auto& [id, robot] : robots) {
      if (robot.engine_body) robot.be_moved(to_s, engine->motion(*robot.engine_body));
    }
    from_s = to_s;
  }
}

template <typename Visit>
void World::Impl::visit_neighbours(const FloorPoint& at, double radius_m, const MovingRobot* self,
                                   const Visit& visit) const {
  for (const Part& part : surroundings.parts()) {
    visit(surroundings.name(part), facing(part, at).distance_m - radius_m);
  }
  for (const Thing& thing : things) {
    const Disc disc{thing.path.stretch(seconds(now)).at, thing.radius_m};
    visit(thing.name, facing(disc, at).distance_m - radius_m);
  }
  for (const auto& [id, other] : robots) {
    if (&other == self || other.radius_m() == 0) continue;
    visit(other.name(), facing(Disc{other.place(), other.radius_m()}, at).distance_m - radius_m);
  }
}

void World::Impl::update_contact(MovingRobot& robot) const {
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
  if (nearest == nullptr) {
    robot.contact.clear();
  } else {
    robot.contact = *nearest;
  }
}

World::World(const PlaceSettings& place) : impl_(std::make_unique<Impl>(place)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

std::uint64_t World::step_number() const { return impl_->step_number; }
std::chrono::nanoseconds World::now() const { return impl_->now; }
double World::rate_hz() const { return impl_->rate_hz; }

void World::set_rate(double rate_hz) {
  assert(rate_hz > 0);
  if (rate_hz == impl_->rate_hz) return;
  impl_->rate_hz = rate_hz;
  impl_->base_step = impl_->step_number;
  impl_->base = impl_->now;
}

void World::step() { impl_->step(); }

void World::begin_anew() {
  impl_->robots.clear();
  impl_->next_robot = 0;
  impl_->engine.reset();
  impl_->base_step = impl_->step_number = 0;
  impl_->base = impl_->now = std::chrono::nanoseconds(0);
}

Result<World::RobotId> World::add_robot(const RobotBody& robot) {
  const Pose2& begin = robot.begin ? *robot.begin : robot.start;
  const FloorPoint at{begin.x_m, begin.y_m};
  const std::string* touched = nullptr;
  if (robot.radius_m > 0) {
    touched = impl_->surroundings.outline_around(at);
    double nearest_m = kTouch_m;
    impl_->visit_neighbours(at, robot.radius_m, nullptr, [&](const std::string& name, double gap_m) {
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
    if (!impl_->engine) {
      auto engine = PhysicsEngine::open();
      if (!engine) return engine.error();
      impl_->engine = std::move(*engine);
    }
    added.engine_body = impl_->engine->add(robot, added.pose());
  }
  const RobotId id = impl_->next_robot++;
  impl_->robots.emplace(id, std::move(added));
  return id;
}

void World::abandon(RobotId robot) {
  MovingRobot& abandoned = impl_->at(robot);
  if (abandoned.engine_body) impl_->engine->remove(*abandoned.engine_body);
  abandoned.abandon();
}

void World::remove(RobotId robot) {
  if (const auto body = impl_->at(robot).engine_body) impl_->engine->remove(*body);
  impl_->robots.erase(robot);
  for (auto& [id, other] : impl_->robots) impl_->update_contact(other);
}

void World::command(RobotId robot, const WheelSpeeds& speeds) { impl_->at(robot).command(speeds, impl_->now); }
void World::halt(RobotId robot) { impl_->at(robot).halt(); }
const Pose2& World::pose(RobotId robot) const { return impl_->at(robot).pose(); }
const World::Turned& World::turned(RobotId robot) const { return impl_->at(robot).turned(); }
const std::string& World::contact(RobotId robot) const { return impl_->at(robot).contact; }

Pose2 World::moving_pose(std::size_t thing) const { return moving_pose_before(thing, std::chrono::nanoseconds(0)); }

Pose2 World::pose_before(RobotId robot, std::chrono::nanoseconds before) const {
  return impl_->at(robot).pose_before(before);
}

Pose2 World::moving_pose_before(std::size_t thing, std::chrono::nanoseconds before) const {
  assert(thing < impl_->things.size());
  return impl_->things[thing].path.pose(seconds(impl_->now - before));
}

double encoder_reading_rad(double turned_rad, int counts_per_turn) {
  if (counts_per_turn == 0) return turned_rad;
  constexpr double kTurn_rad = 2 * std::numbers::pi;
  return std::floor(turned_rad / kTurn_rad * counts_per_turn) / counts_per_turn * kTurn_rad;
}

}  // namespace twocone::sim_povray
