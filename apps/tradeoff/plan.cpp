// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include <fmt/format.h>
#include <Eigen/Core>

#include "apps/behaviours/behaviour.h"
#include "apps/files/file_error.h"
#include "apps/files/to_layers.h"
#include "apps/runs/bounds.h"
#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"

namespace twocone::tradeoff {
namespace {

/// Legs of a sweep and of a check come from different streams of one seed.
enum class Stream : std::uint32_t { kSweep = 1, kCheck = 2 };

/// Numbers in [0, 1), the same with every standard library.
class Numbers {
 public:
  Numbers(std::uint64_t seed, Stream stream, int leg) {
    std::seed_seq words{std::uint32_t(seed), std::uint32_t(seed >> 32U), std::uint32_t(stream), std::uint32_t(leg)};
    engine_.seed(words);
  }
  double next() { return double(engine_() >> 11U) * 0x1p-53; }
  double between(double least, double most) { return least + (most - least) * next(); }
  std::uint64_t bits() { return engine_(); }

 private:
  std::mt19937_64 engine_;
};

constexpr int kMostTries = 10'000;
/// Of the top speed.
constexpr double kSlowest = 0.2;
constexpr double kFastest = 0.7;
/// Of the sum of both wheels' speeds, how much they differ at most.
constexpr double kSharpestTurn = 0.6;

Leg make_leg(const files::Robot& robot, const files::Map& map, const behaviours::Arena& arena, std::uint64_t seed,
             Stream stream, int number) {
  Numbers numbers(seed, stream, number);
  Leg leg;
  leg.seed = numbers.bits();
  const double room_m = robot.body_radius_m + behaviours::Wander::kMargin_m;
  for (int i = 0; i < kMostTries; ++i) {
    const double speed_mps = robot.drive.max_speed_mps * numbers.between(kSlowest, kFastest);
    const double turn = numbers.between(-kSharpestTurn, kSharpestTurn);
    localisation::Pose pose{numbers.between(map.bounds.min_x_m, map.bounds.max_x_m),
                            numbers.between(map.bounds.min_y_m, map.bounds.max_y_m),
                            numbers.between(-std::numbers::pi, std::numbers::pi)};
    leg.from = {pose.x_m, pose.y_m, pose.heading_rad};
    const double left_mps = speed_mps * (1 - turn);
    const double right_mps = speed_mps * (1 + turn);
    leg.speeds = {left_mps / robot.drive.wheel_radius_m, right_mps / robot.drive.wheel_radius_m};
    bool has_room = arena.clearance_m({pose.x_m, pose.y_m}) > room_m;
    for (int k = 1; k < kInstants && has_room; ++k) {
      pose = localisation::drive_arc(pose, left_mps / robot.lower.rate_hz, right_mps / robot.lower.rate_hz,
                                     robot.drive.wheel_separation_m);
      has_room = arena.clearance_m({pose.x_m, pose.y_m}) > room_m;
    }
    if (has_room) return leg;
  }
  throw files::FileError(
      fmt::format("{}: {} random poses and none with {:.2f} m of room around it: is body.radius_m "
                  "right for this room?",
                  map.file.string(), kMostTries, room_m));
}

std::vector<Leg> make_legs(const files::Robot& robot, const files::Map& map, std::uint64_t seed, Stream stream,
                           int count) {
  const behaviours::Arena arena = files::to_arena(map);
  std::vector<Leg> legs;
  legs.reserve(std::size_t(count));
  for (int i = 0; i < count; ++i) legs.push_back(make_leg(robot, map, arena, seed, stream, i));
  return legs;
}

// ---- which landmarks

/// Any noise does: it scales all bounds alike.
constexpr double kEdgeNoise_px = 0.1;
/// Where the landmarks that are left do not tell the pose.
constexpr double kUnknown_m2 = 100;

/// information[leg][landmark] of range and bearing.
std::vector<std::vector<Eigen::Matrix2d>> information_of(const files::Robot& robot, const files::Map& map,
                                                         const std::vector<Leg>& legs) {
  const vision::Rig rig = files::to_rig(robot);
  const std::vector<vision::Target> targets = files::to_targets(map);
  const std::vector<Eigen::Vector2d> places_m = files::to_landmark_positions(map);
  const auto noise_px = [](const std::string&, const std::string&) { return std::optional(kEdgeNoise_px); };
  std::vector<std::vector<Eigen::Matrix2d>> information;
  information.reserve(legs.size());
  for (const Leg& leg : legs) {
    const localisation::Pose pose{leg.from.x_m, leg.from.y_m, leg.from.heading_rad};
    information.push_back(runs::landmark_information(rig, targets, places_m, pose, noise_px));
  }
  return information;
}

std::vector<std::string> rank_landmarks(const files::Robot& robot, const files::Map& map,
                                        const std::vector<Leg>& legs) {
  const std::vector<Eigen::Vector2d> places_m = files::to_landmark_positions(map);
  const auto all = information_of(robot, map, legs);
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < places_m.size(); ++k) kept.push_back(k);
  const auto cost_without = [&](std::size_t out) {
    double sum_m2 = 0;
    for (std::size_t i = 0; i < legs.size(); ++i) {
      auto information = all[i];
      for (std::size_t k = 0; k < information.size(); ++k) {
        if (k == out || std::find(kept.begin(), kept.end(), k) == kept.end()) information[k].setZero();
      }
      const Pose2& from = legs[i].from;
      const auto bound = localisation::pose_bound({from.x_m, from.y_m, from.heading_rad}, places_m, information);
      sum_m2 += bound ? std::min((*bound)(0, 0) + (*bound)(1, 1), kUnknown_m2) : kUnknown_m2;
    }
    return sum_m2;
  };
  std::vector<std::string> last_first;
  while (!kept.empty()) {
    auto least = kept.begin();
    double least_m2 = std::numeric_limits<double>::infinity();
    for (auto at = kept.begin(); at != kept.end(); ++at) {
      const double cost_m2 = cost_without(*at);
      if (cost_m2 < least_m2) {
        least_m2 = cost_m2;
        least = at;
      }
    }
    last_first.push_back(map.landmarks[*least].name);
    kept.erase(least);
  }
  return {last_first.rbegin(), last_first.rend()};
}

// ---- which settings

struct Fraction {
  int over, under;
};

/// Pictures of the robot's size times `k`; none where that is not a whole number of pixels.
std::optional<Pictures> pictures_of(const files::Robot& robot, Fraction k, int antialias, Effects effects) {
  const auto whole = [k](int side_px) { return side_px * k.over % k.under == 0; };
  for (const files::CameraEntry* camera : {&robot.lower, &robot.upper}) {
    if (!whole(camera->width_px) || !whole(camera->height_px)) return std::nullopt;
  }
  return Pictures{robot.lower.width_px * k.over / k.under, robot.lower.height_px * k.over / k.under, antialias,
                  effects};
}

struct Step {
  Fraction size;
  std::vector<int> antialias;
};

std::vector<Step> steps_of(bool is_fine) {
  if (!is_fine) {
    return {{{1, 4}, {1, 2}},    {{3, 8}, {1, 2}}, {{1, 2}, {1, 2, 3}}, {{3, 4}, {1, 2}},
            {{1, 1}, {1, 2, 3}}, {{3, 2}, {2}},    {{2, 1}, {2}}};
  }
  return {{{1, 8}, {1, 2, 3}},    {{1, 4}, {1, 2, 3}}, {{3, 8}, {1, 2, 3}}, {{1, 2}, {1, 2, 3, 4}}, {{3, 4}, {1, 2, 3}},
          {{1, 1}, {1, 2, 3, 4}}, {{3, 2}, {1, 2, 3}}, {{2, 1}, {1, 2, 3}}, {{3, 1}, {1, 2}}};
}

/// From what all of a picture gives to what its coarsest look gives.
constexpr std::array kEnough_m{0.0001, 0.0003, 0.001};

class Settings {
 public:
  Settings(const files::Robot& robot, const files::Map& map) {
    all_.landmarks = int(map.landmarks.size());
    all_.rate_hz = robot.lower.rate_hz;
    try {
      const runs::Estimator paper(runs::Method::kPaper, robot, map);
    } catch (const files::FileError&) {
      has_paper_ = false;  // a mirror that the paper's formulas do not hold for
    }
  }

  /// Every level, by single frames and fused.
  void add_levels(const Pictures& pictures) {
    if (has_paper_) add(pictures, {.level = Level::kPaper});
    for (const Level level : {Level::kFound, Level::kCoarse, Level::kFine}) {
      add(pictures, {.level = level});
      add(pictures, {.level = level, .frames = kInstants});
    }
    for (const double enough_m : kEnough_m) add(pictures, {.level = Level::kAdaptive, .enough_m = enough_m});
    add(pictures, {.level = Level::kAdaptive, .enough_m = kEnough_m.front(), .frames = kInstants});
  }
  /// What needs no further pictures but concerns few sizes.
  void add_details(const Pictures& pictures) {
    for (int n = 3; n < all_.landmarks; ++n) add(pictures, {.landmarks = n});
    add(pictures, {.bearings = false});
    if (all_.landmarks > 4) add(pictures, {.landmarks = 4, .bearings = false});
    for (const int part : {1, 2, 3}) add(pictures, {.rate_hz = all_.rate_hz / part, .frames = 2});
  }
  void add_effects(const Pictures& pictures) {
    if (has_paper_) add(pictures, {.level = Level::kPaper});
    for (const Level level : {Level::kFound, Level::kFine}) add(pictures, {.level = level});
    add(pictures, {.frames = kInstants});
  }

  [[nodiscard]] std::vector<Setting> take() { return std::move(settings_); }

 private:
  /// Differs from the most accurate way of single frames.
  struct Change {
    Level level = Level::kFine;
    double enough_m = 0;
    int landmarks = 0;
    bool bearings = true;
    double rate_hz = 0;
    int frames = 1;
  };
  void add(const Pictures& pictures, const Change& change) {
    Setting setting = all_;
    setting.pictures = pictures;
    setting.level = change.level;
    setting.enough_m = change.enough_m;
    if (change.landmarks > 0) setting.landmarks = change.landmarks;
    setting.bearings = change.bearings;
    if (change.rate_hz > 0) setting.rate_hz = change.rate_hz;
    setting.frames = change.frames;
    settings_.push_back(setting);
  }

  Setting all_;
  bool has_paper_ = true;
  std::vector<Setting> settings_;
};

// ---- how many legs, in which shards

/// Rendering grows so with the rays per pixel's side (bench/growth_bench: 1, 1.9 and 2.7 in the lab).
double rays(int antialias) { return 0.15 + 0.85 * antialias; }
/// Pictures that cost less than this share of the robot's own, without anti-aliasing, have all legs.
constexpr double kCheap = 0.5;
constexpr int kLeastLegs = 3;
/// Pictures of so many legs are held at a time.
constexpr int kLegsOfShard = 4;

int legs_of(const Pictures& pictures, const files::Robot& robot, int legs) {
  const double own = double(robot.lower.width_px) * robot.lower.height_px;
  const double cost = double(pictures.width_px) * pictures.height_px / own * rays(pictures.antialias);
  const double share = std::clamp(std::sqrt(kCheap / cost), 1.0 / 3, 1.0);
  return std::max(kLeastLegs, static_cast<int>(std::lround(legs * share)));
}

void add_shards(const Pictures& pictures, int legs, std::vector<Plan::Shard>& shards) {
  for (int first = 0; first < legs; first += kLegsOfShard) {
    shards.push_back({pictures, first, std::min(kLegsOfShard, legs - first)});
  }
}

void check(const files::Robot& robot, const files::Map& map) {
  if (!files::is_simulated(robot)) {
    throw files::FileError(fmt::format("{}: driver is '{}', must be sim_povray: settings are tried in simulation",
                                       robot.file.string(), robot.drive.driver));
  }
  if (!robot.attach.empty()) {
    throw files::FileError(fmt::format("{}: attach is '{}', must be absent: settings are tried in a world of their own",
                                       robot.file.string(), robot.attach));
  }
  if (map.landmarks.size() < 3) {
    throw files::FileError(
        fmt::format("{}: there are {} landmarks, must be at least 3", map.file.string(), map.landmarks.size()));
  }
  (void)files::to_robot_settings(robot, map, 1);
}

}  // namespace

std::vector<int> instants_of(const Setting& setting, double robot_rate_hz) {
  const int step = static_cast<int>(std::lround(robot_rate_hz / setting.rate_hz));
  std::vector<int> instants;
  instants.reserve(std::size_t(setting.frames));
  for (int i = 0; i < setting.frames; ++i) instants.push_back(kInstants - 1 - i * step);
  return instants;
}

Plan make_plan(const files::Robot& robot, const files::Map& map, const PlanOptions& options) {
  if (options.legs < kLeastLegs) {
    throw std::invalid_argument(fmt::format("legs is {}, must be >= {}", options.legs, kLeastLegs));
  }
  check(robot, map);
  Plan plan;
  plan.options = options;
  plan.robot_rate_hz = robot.lower.rate_hz;
  const int legs = options.fine ? 4 * options.legs : options.legs;
  plan.legs = make_legs(robot, map, options.seed, Stream::kSweep, legs);
  plan.landmarks = rank_landmarks(robot, map, plan.legs);

  Settings settings(robot, map);
  std::vector<Pictures> all;
  const auto with = [&](const std::optional<Pictures>& pictures, auto add) {
    if (!pictures) return;
    if (std::find(all.begin(), all.end(), *pictures) == all.end()) all.push_back(*pictures);
    (settings.*add)(*pictures);
  };
  for (const Step& step : steps_of(options.fine)) {
    for (const int antialias : step.antialias) {
      with(pictures_of(robot, step.size, antialias, Effects::kScene), &Settings::add_levels);
    }
  }
  for (const Fraction size : {Fraction{1, 2}, {1, 1}}) {
    with(pictures_of(robot, size, 1, Effects::kScene), &Settings::add_details);
    for (const Effects effects : {Effects::kFlat, Effects::kNoise}) {
      with(pictures_of(robot, size, 1, effects), &Settings::add_effects);
    }
  }
  plan.settings = settings.take();
  for (const Pictures& pictures : all) add_shards(pictures, legs_of(pictures, robot, legs), plan.shards);
  return plan;
}

Plan make_check_plan(const files::Robot& robot, const files::Map& map, const Plan& sweep, const Pictures& pictures,
                     int legs) {
  if (legs < kLeastLegs) throw std::invalid_argument(fmt::format("legs is {}, must be >= {}", legs, kLeastLegs));
  check(robot, map);
  Plan plan;
  plan.options = sweep.options;
  plan.options.legs = legs;
  plan.robot_rate_hz = sweep.robot_rate_hz;
  plan.legs = make_legs(robot, map, sweep.options.seed, Stream::kCheck, legs);
  plan.landmarks = sweep.landmarks;
  std::copy_if(sweep.settings.begin(), sweep.settings.end(), std::back_inserter(plan.settings),
               [&](const Setting& setting) { return setting.pictures == pictures; });
  add_shards(pictures, legs, plan.shards);
  return plan;
}

}  // namespace twocone::tradeoff
