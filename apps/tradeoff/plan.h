// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/tradeoff/sweep.h"
#include "base/plane.h"
#include "hal/diff_drive.h"

namespace twocone::tradeoff {

/// A short drive from a random pose: kStepsOfEpisode frames at the robot's rate. Episodes are mutually independent.
struct Episode {
  std::uint64_t seed = 0;  ///< of the wheels' slip and the cameras' noise
  Pose2 from;
  WheelSpeeds speeds;  ///< constant for the whole episode
};
constexpr int kStepsOfEpisode = 4;

/// Returns the frames of an episode that a setting uses for one answer, in their order. They are the setting's `frames`
/// frames at its rate that end with the episode's last one. If `frames` is 1, each frame of the episode has an answer
/// of its own, and this function returns the last frame.
std::vector<int> steps_of(const Setting& setting, double robot_rate_hz);

/// The user's options of a sweep.
struct PlanOptions {
  std::uint64_t seed = 1;
  /// Number of episodes for cheap images, >= 3. More expensive images have fewer, but at least a third and at least 3.
  int episodes = 28;
  bool fine = false;  ///< more sizes and more anti-aliasing, four times the episodes
};

/// All work of a sweep, in the order of the results.
struct Plan {
  PlanOptions options;
  double robot_rate_hz = 0;       ///< of the robot file: rate of the episodes' frames
  std::vector<Episode> episodes;  ///< images with fewer episodes use the first ones
  std::vector<Setting> settings;
  /// The map's landmarks; a setting with n landmarks searches for the first n of them. Backward elimination orders
  /// them: the last place that is still free is for the landmark whose removal raises the mean squared position bound
  /// over the episodes least.
  std::vector<std::string> landmarks;
  /// A unit of work that is independent of the others: images of some episodes, and all settings that use them.
  struct Shard {
    Images images;
    int first_episode = 0, episodes = 0;
  };
  std::vector<Shard> shards;
};

/// Returns a plan that depends on the arguments only.
/// @throws config::FileError for a robot that does not move in a simulation inside this program, for a room without
/// enough free space for it, and for a map with fewer than three landmarks
/// @throws std::invalid_argument for options outside their domain
Plan make_plan(const config::Robot& robot, const config::Map& map, const PlanOptions& options);

/// Returns a plan that checks the sweep's settings with these images on `episodes` episodes that no sweep uses.
/// @throws as make_plan for the number of episodes and the room
Plan make_check_plan(const config::Robot& robot, const config::Map& map, const Plan& sweep, const Images& images,
                     int episodes);

/// Returns the index of the plan's first setting with these images. Rows about the images name this setting.
std::size_t first_of(const Plan& plan, const Images& images);

}  // namespace twocone::tradeoff
