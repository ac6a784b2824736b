// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/steering.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/behaviours/explore.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/design/sight.h"
#include "base/errors.h"

namespace twocone::runs {
namespace {

std::unique_ptr<behaviours::Behaviour> make_explorer(const config::Robot& robot, const config::Map& map,
                                                     const behaviours::Body& body) {
  const design::Sight sight(config::to_rig(robot));
  const design::Reach reach = design::reach_of(sight);
  if (!reach.floor_from_m) {
    throw config::FileError(
        "{}: behaviour explore needs mirrors that both see the floor, and {}; `twocone design --floor-from-m 1.4` "
        "finds such a pair",
        robot.file.string(), design::words_of(reach));
  }
  constexpr double kStep_m = 0.05;
  std::vector<double> lowest_m;
  for (int k = 0; k * kStep_m <= behaviours::SeenFloor::kFarthest_m + kStep_m; ++k) {
    const auto shared = sight.shared_heights(k * kStep_m);
    lowest_m.push_back(shared ? shared->lowest_m : std::numeric_limits<double>::infinity());
  }
  const auto lowest_seen_m = [lowest_m](double distance_m) {
    return lowest_m[std::min(lowest_m.size() - 1, std::size_t(distance_m / kStep_m))];
  };
  // A decision follows from the image before the latency, and holds for a frame; the wheels obey in the next.
  const double reaction_s = (robot.latency_frames + 2) / robot.lower.settings.rate_hz;
  return std::make_unique<behaviours::Explore>(body, config::to_arena(map), lowest_seen_m, reaction_s);
}

std::unique_ptr<behaviours::Behaviour> make_behaviour(const config::Robot& robot, const config::Map& map,
                                                      const std::string& name, std::uint64_t seed,
                                                      const RemoteControl* remote,
                                                      const behaviours::Controlled::Decide& controller) {
  const behaviours::Body body{robot.body_radius_m, robot.drive.max_speed_mps, robot.drive.wheel_separation_m};
  if (name == "still") return std::make_unique<behaviours::Still>();
  if (name == "wander") return std::make_unique<behaviours::Wander>(body, config::to_arena(map), seed);
  if (name == "explore") return make_explorer(robot, map, body);
  if (name == "waypoints") {
    std::vector<Eigen::Vector2d> points_m;
    for (const config::Point& p : robot.waypoints) points_m.emplace_back(p.x_m, p.y_m);
    if (points_m.empty()) {
      throw config::FileError("{}: behaviour waypoints needs the key waypoints_m: [[x, y], ...] in metres",
                              robot.file.string());
    }
    return std::make_unique<behaviours::Waypoints>(body, points_m);
  }
  if (name == "manual") {
    if (remote == nullptr) throw std::invalid_argument("behaviour manual needs a person who drives: a live page");
    return std::make_unique<behaviours::Manual>(body, [remote] { return remote->requested(); });
  }
  if (name == "controller") {
    if (!controller) throw std::invalid_argument("behaviour controller needs a function that decides how to drive");
    return std::make_unique<behaviours::Controlled>(controller);
  }
  throw base::InvalidArgument("no behaviour '{}'; there are: wander, waypoints, explore, still, manual", name);
}

}  // namespace

Steering::Steering(const config::Robot& robot, const config::Map& map, const std::string& behaviour, std::uint64_t seed,
                   const RemoteControl* remote, const behaviours::Controlled::Decide& controller,
                   std::function<void(const std::string&)> notify)
    : wheels_(config::to_wheels(robot)),
      command_timeout_s_(robot.drive.command_timeout_s),
      remote_(remote),
      notify_(std::move(notify)),
      behaviour_(make_behaviour(robot, map, behaviour, seed, remote, controller)) {}

void Steering::add_scan(std::uint64_t frame, const std::optional<Pose2>& estimate,
                        const std::vector<vision::Beam>& scan) {
  if (estimate) belief_.add_estimate(frame, *estimate);
  behaviour_->see(belief_.pose_at(frame), scan);
}

WheelSpeeds Steering::decide(std::uint64_t frame, double step_s, double image_age_s) {
  if (const bool is_held = remote_ != nullptr && remote_->is_held(); is_held || was_held_) {
    if (std::exchange(was_held_, is_held) != is_held) {
      notify_(fmt::format("frame {}: a person {} the wheels", frame, is_held ? "stopped" : "freed"));
    }
    if (is_held) return {};
  }
  if (image_age_s > command_timeout_s_) {
    if (!std::exchange(was_late_, true)) {
      notify_(
          fmt::format("frame {}: it was worked on for {:.2f} s, longer than command_timeout_s of {} s: the wheels "
                      "are stopped for this and any other such frame",
                      frame, image_age_s, command_timeout_s_));
    }
    return {};
  }
  const behaviours::Motion motion = behaviour_->decide(belief_.pose(), step_s);
  const auto turned = localisation::wheel_turns(wheels_, motion.speed_mps, motion.turn_rate_radps);
  return {turned.left_rad, turned.right_rad};
}

}  // namespace twocone::runs
