// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include <Eigen/Core>

#include "apps/behaviours/behaviour.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/estimator.h"
#include "apps/runlog/summary/bounds.h"
#include "apps/tradeoff/statistics.h"
#include "base/errors.h"
#include "base/random.h"
#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"

namespace twocone::tradeoff {
namespace {

/// Random streams of one seed. The episodes of a sweep and of a check come from different ones.
enum class Stream : std::uint32_t { kSweep = 1, kCheck = 2 };

constexpr int kMostTries = 10'000;
/// Speeds as fractions of the top speed.
constexpr double kSlowest = 0.2;
constexpr double kFastest = 0.7;
/// Greatest difference of both wheels' speeds, as a fraction of their sum.
constexpr double kSharpestTurn = 0.6;

Episode make_episode(const config::Robot& robot, const config::Map& map, const behaviours::Arena& arena,
                     std::uint64_t seed, Stream stream, int number) {
  std::seed_seq words{std::uint32_t(seed), std::uint32_t(seed >> 32U), std::uint32_t(stream), std::uint32_t(number)};
  std::mt19937_64 random(words);
  const auto between = [&](double least, double most) { return least + (most - least) * base::fraction(random); };
  Episode episode;
  episode.seed = random();
  const double room_m = robot.body_radius_m + behaviours::Wander::kMargin_m;
  for (int i = 0; i < kMostTries; ++i) {
    const double speed_mps = robot.drive.max_speed_mps * between(kSlowest, kFastest);
    const double turn = between(-kSharpestTurn, kSharpestTurn);
    localisation::Pose pose{between(map.bounds.min_x_m, map.bounds.max_x_m),
                            between(map.bounds.min_y_m, map.bounds.max_y_m),
                            between(-std::numbers::pi, std::numbers::pi)};
    episode.from = pose;
    const double left_mps = speed_mps * (1 - turn);
    const double right_mps = speed_mps * (1 + turn);
    episode.speeds = {left_mps / robot.drive.wheel_radius_m, right_mps / robot.drive.wheel_radius_m};
    bool has_room = arena.clearance_m({pose.x_m, pose.y_m}) > room_m;
    for (int k = 1; k < kStepsOfEpisode && has_room; ++k) {
      pose = localisation::drive_arc(pose, left_mps / robot.lower.settings.rate_hz,
                                     right_mps / robot.lower.settings.rate_hz, robot.drive.wheel_separation_m);
      has_room = arena.clearance_m({pose.x_m, pose.y_m}) > room_m;
    }
    if (has_room) return episode;
  }
  throw config::FileError(
      "{}: none of {} random poses has {:.2f} m of free space around it: is body.radius_m right for this room?",
      map.file.string(), kMostTries, room_m);
}

std::vector<Episode> make_episodes(const config::Robot& robot, const config::Map& map, std::uint64_t seed,
                                   Stream stream, int count) {
  const behaviours::Arena arena = config::to_arena(map);
  std::vector<Episode> episodes;
  episodes.reserve(std::size_t(count));
  for (int i = 0; i < count; ++i) episodes.push_back(make_episode(robot, map, arena, seed, stream, i));
  return episodes;
}

// ---- order of the landmarks

/// Noise of the outlines. Its value does not change the order, because it scales all bounds equally.
constexpr double kEdgeNoise_px = 0.1;
/// Squared bound that is used if the remaining landmarks do not determine the pose.
constexpr double kUnknown_m2 = 100;

std::vector<std::string> rank_landmarks(const config::Robot& robot, const config::Map& map,
                                        const std::vector<Episode>& episodes) {
  const vision::Rig rig = config::to_rig(robot);
  const std::vector<Landmark> targets = config::to_targets(map);
  const std::vector<Eigen::Vector2d> places_m = config::to_landmark_positions(map);
  const auto noise_px = [](const std::string&, const std::string&) { return std::optional(kEdgeNoise_px); };
  std::vector<std::vector<Eigen::Matrix2d>> all;  // [episode][landmark], of range and bearing
  all.reserve(episodes.size());
  for (const Episode& episode : episodes) {
    std::vector<Eigen::Matrix2d>& of_both = all.emplace_back();
    for (const auto& [lower, upper] : runlog::landmark_information(rig, targets, places_m, episode.from, noise_px)) {
      of_both.emplace_back(lower + upper);
    }
  }
  std::vector<std::size_t> kept(places_m.size());
  std::iota(kept.begin(), kept.end(), 0);
  const auto cost_without = [&](std::size_t out) {
    double sum_m2 = 0;
    for (std::size_t i = 0; i < episodes.size(); ++i) {
      auto information = all[i];
      for (std::size_t k = 0; k < information.size(); ++k) {
        if (k == out || std::find(kept.begin(), kept.end(), k) == kept.end()) information[k].setZero();
      }
      const auto bound = localisation::pose_bound(episodes[i].from, places_m, information);
      sum_m2 += bound ? std::min((*bound)(0, 0) + (*bound)(1, 1), kUnknown_m2) : kUnknown_m2;
    }
    return sum_m2;
  };
  std::vector<std::string> last_first;
  while (!kept.empty()) {
    std::vector<double> costs_m2;
    costs_m2.reserve(kept.size());
    for (const std::size_t out : kept) costs_m2.push_back(cost_without(out));
    const auto least = kept.begin() + (std::min_element(costs_m2.begin(), costs_m2.end()) - costs_m2.begin());
    last_first.push_back(map.landmarks[*least].name);
    kept.erase(least);
  }
  return {last_first.rbegin(), last_first.rend()};
}

// ---- the settings

struct Fraction {
  int over, under;
};

/// Returns images of the robot's size times `k`, or nothing if that is not a whole number of pixels.
std::optional<Images> images_of(const config::Robot& robot, Fraction k, int antialias, Effects effects) {
  for (const int side_px : {robot.lower.settings.width_px, robot.lower.settings.height_px,
                            robot.upper.settings.width_px, robot.upper.settings.height_px}) {
    if (side_px * k.over % k.under != 0) return std::nullopt;
  }
  return Images{robot.lower.settings.width_px * k.over / k.under, robot.lower.settings.height_px * k.over / k.under,
                antialias, effects};
}

/// A size of the sweep, with the anti-aliasing of its sets of images.
struct SizeStep {
  Fraction size;
  std::vector<int> antialias;
};

std::vector<SizeStep> sizes_of(bool is_fine) {
  if (!is_fine) {
    return {{{1, 4}, {1, 2}},    {{3, 8}, {1, 2}}, {{1, 2}, {1, 2, 3}}, {{3, 4}, {1, 2}},
            {{1, 1}, {1, 2, 3}}, {{3, 2}, {2}},    {{2, 1}, {2}}};
  }
  return {{{1, 8}, {1, 2, 3}},    {{1, 4}, {1, 2, 3}}, {{3, 8}, {1, 2, 3}}, {{1, 2}, {1, 2, 3, 4}}, {{3, 4}, {1, 2, 3}},
          {{1, 1}, {1, 2, 3, 4}}, {{3, 2}, {1, 2, 3}}, {{2, 1}, {1, 2, 3}}, {{3, 1}, {1, 2}}};
}

/// Values of Setting::enough_m, from the precision of a full fit to that of the coarsest stage.
constexpr std::array kEnough_m{0.0001, 0.0003, 0.001};

/// Returns whether the paper's formulas hold for the robot's mirrors.
bool is_for_paper(const config::Robot& robot, const config::Map& map) {
  try {
    const estimation::Estimator paper(estimation::Method::kPaper, robot, map);
    return true;
  } catch (const config::FileError&) {
    return false;
  }
}

// The settings of one set of images, without the images. 0 landmarks means all, and a rate of 0 means the robot's own.

/// Returns settings of every level, for single frames and for several frames.
std::vector<Setting> levels(bool has_paper) {
  std::vector<Setting> all;
  if (has_paper) all.push_back({.level = Level::kPaper});
  for (const Level level : {Level::kFound, Level::kCoarse, Level::kFine}) {
    all.push_back({.level = level});
    all.push_back({.level = level, .frames = kStepsOfEpisode});
  }
  for (const double enough_m : kEnough_m) all.push_back({.level = Level::kAdaptive, .enough_m = enough_m});
  all.push_back({.level = Level::kAdaptive, .enough_m = kEnough_m.front(), .frames = kStepsOfEpisode});
  return all;
}

/// Returns settings that require no additional images but are swept for few sizes only.
std::vector<Setting> details(int landmarks, double rate_hz) {
  std::vector<Setting> all;
  for (int n = 3; n < landmarks; ++n) all.push_back({.landmarks = n});
  all.push_back({.bearings = false});
  if (landmarks > 4) all.push_back({.landmarks = 4, .bearings = false});
  for (const int part : {1, 2, 3}) all.push_back({.rate_hz = rate_hz / part, .frames = 2});
  return all;
}

/// Returns the settings for images with other effects than the scene's.
std::vector<Setting> few_levels(bool has_paper) {
  std::vector<Setting> all;
  if (has_paper) all.push_back({.level = Level::kPaper});
  for (const Level level : {Level::kFound, Level::kFine}) all.push_back({.level = level});
  all.push_back({.frames = kStepsOfEpisode});
  return all;
}

// ---- number of episodes, shards

/// Returns the relative rendering time for this number of rays per pixel side (bench/growth_bench: 1, 1.9 and 2.7 for 1
/// to 3 in the lab).
double rays(int antialias) { return 0.15 + 0.85 * antialias; }
/// Images that cost less than this fraction of the robot's own images without anti-aliasing have all episodes.
constexpr double kCheap = 0.5;
/// Limit for the number of episodes whose images are in memory at a time.
constexpr int kEpisodesOfShard = 4;

int episodes_of(const Images& images, const config::Robot& robot, int episodes) {
  const double own = double(robot.lower.settings.width_px) * robot.lower.settings.height_px;
  const double cost = double(images.width_px) * images.height_px / own * rays(images.antialias);
  const double share = std::clamp(std::sqrt(kCheap / cost), 1.0 / 3, 1.0);
  return std::max(int(kLeastEpisodes), static_cast<int>(std::lround(episodes * share)));
}

void add_shards(const Images& images, int episodes, std::vector<Plan::Shard>& shards) {
  for (int first = 0; first < episodes; first += kEpisodesOfShard) {
    shards.push_back({images, first, std::min(kEpisodesOfShard, episodes - first)});
  }
}

void check(const config::Robot& robot, const config::Map& map) {
  if (!config::is_simulated(robot)) {
    throw config::FileError("{}: driver is '{}', must be sim_povray: settings are tested in simulation",
                            robot.file.string(), robot.drive.driver);
  }
  if (!robot.attach.empty()) {
    throw config::FileError("{}: attach is '{}', must be absent: settings are tested in a separate world",
                            robot.file.string(), robot.attach);
  }
  if (map.landmarks.size() < 3) {
    throw config::FileError("{}: there are {} landmarks, must be at least 3", map.file.string(), map.landmarks.size());
  }
  (void)config::to_robot_settings(robot, map, 1);
}

void check_number(int episodes) {
  if (episodes >= int(kLeastEpisodes)) return;
  throw base::InvalidArgument("episodes is {}, must be >= {}", episodes, kLeastEpisodes);
}

}  // namespace

std::vector<int> steps_of(const Setting& setting, double robot_rate_hz) {
  const int step = static_cast<int>(std::lround(robot_rate_hz / setting.rate_hz));
  std::vector<int> steps;
  steps.reserve(std::size_t(setting.frames));
  for (int i = setting.frames - 1; i >= 0; --i) steps.push_back(kStepsOfEpisode - 1 - i * step);
  return steps;
}

Plan make_plan(const config::Robot& robot, const config::Map& map, const PlanOptions& options) {
  check_number(options.episodes);
  check(robot, map);
  Plan plan;
  plan.options = options;
  plan.robot_rate_hz = robot.lower.settings.rate_hz;
  const int episodes = options.fine ? 4 * options.episodes : options.episodes;
  plan.episodes = make_episodes(robot, map, options.seed, Stream::kSweep, episodes);
  plan.landmarks = rank_landmarks(robot, map, plan.episodes);

  const bool has_paper = is_for_paper(robot, map);
  std::vector<Images> all;
  const auto add = [&](const std::optional<Images>& images, const std::vector<Setting>& settings) {
    if (!images) return;
    if (std::ranges::find(all, *images) == all.end()) all.push_back(*images);
    for (Setting setting : settings) {
      setting.images = *images;
      if (setting.landmarks == 0) setting.landmarks = int(map.landmarks.size());
      if (setting.rate_hz == 0) setting.rate_hz = plan.robot_rate_hz;
      plan.settings.push_back(setting);
    }
  };
  for (const SizeStep& step : sizes_of(options.fine)) {
    for (const int antialias : step.antialias) {
      add(images_of(robot, step.size, antialias, Effects::kScene), levels(has_paper));
    }
  }
  for (const Fraction size : {Fraction{1, 2}, {1, 1}}) {
    add(images_of(robot, size, 1, Effects::kScene), details(int(map.landmarks.size()), plan.robot_rate_hz));
    for (const Effects effects : {Effects::kFlat, Effects::kNoise}) {
      add(images_of(robot, size, 1, effects), few_levels(has_paper));
    }
  }
  for (const Images& images : all) add_shards(images, episodes_of(images, robot, episodes), plan.shards);
  return plan;
}

Plan make_check_plan(const config::Robot& robot, const config::Map& map, const Plan& sweep, const Images& images,
                     int episodes) {
  check_number(episodes);
  Plan plan = sweep;
  plan.options.episodes = episodes;
  plan.episodes = make_episodes(robot, map, sweep.options.seed, Stream::kCheck, episodes);
  std::erase_if(plan.settings, [&](const Setting& setting) { return setting.images != images; });
  plan.shards.clear();
  add_shards(images, episodes, plan.shards);
  return plan;
}

std::size_t first_of(const Plan& plan, const Images& images) {
  return std::size_t(std::ranges::find(plan.settings, images, &Setting::images) - plan.settings.begin());
}

}  // namespace twocone::tradeoff
