// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "apps/behaviours/behaviour.h"
#include "apps/config/map_file.h"
#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "base/random.h"
#include "bench/growth/growth.h"
#include "bench/growth/seen.h"

namespace twocone::bench {
namespace {

constexpr std::array kRobots{1, 2, 4, 6, 8};
constexpr int kRooms = 10;  ///< each is one repeat
constexpr int kPoses = 4;   ///< in each room
/// Least distance between two robots, from middle to middle.
constexpr double kApart_m = 0.5;

/// The poses of all robots in one room.
struct Room {
  std::vector<Pose2> poses;  ///< of the robot that measures
  std::vector<Pose2> others;
};

Room make_room(const config::Robot& robot, const config::Map& map, int number) {
  std::mt19937_64 random(std::uint64_t(number) + 1);
  const auto between = [&random](double least, double most) { return least + (most - least) * base::fraction(random); };
  const behaviours::Arena arena = config::to_arena(map);
  std::vector<Pose2> all;
  while (all.size() < kPoses + std::size_t(kRobots.back() - 1)) {
    const Pose2 pose{between(map.bounds.min_x_m, map.bounds.max_x_m), between(map.bounds.min_y_m, map.bounds.max_y_m),
                     between(-std::numbers::pi, std::numbers::pi)};
    const bool is_free = std::all_of(all.begin(), all.end(), [&pose](const Pose2& other) {
      return std::hypot(other.x_m - pose.x_m, other.y_m - pose.y_m) > kApart_m;
    });
    if (is_free && arena.clearance_m({pose.x_m, pose.y_m}) > robot.body_radius_m) all.push_back(pose);
  }
  return {{all.begin(), all.begin() + kPoses}, {all.begin() + kPoses, all.end()}};
}

/// Opens the lab with the first `others` of the other robots.
std::shared_ptr<sim_povray::SimulationHost> open(const config::Map& map, const Room& room, int others,
                                                 const Options& options) {
  std::ifstream in(*map.scene);
  std::string scene{std::istreambuf_iterator<char>(in), {}};
  scene += fmt::format("\n#include \"{}/scenes/parts/robot.inc\"\n", TWOCONE_SOURCE_DIR);
  for (int i = 0; i < others; ++i) scene += robot_at(room.others[std::size_t(i)]);
  sim_povray::PlaceSettings place = config::to_place(map);
  place.scene = options.scratch / "bystanders.pov";
  std::ofstream(place.scene) << scene;
  return value(sim_povray::SimulationHost::open(place));
}

}  // namespace

Growth grow_error_by_robots(const Options& options) {
  const config::Robot robot = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  const config::Map map = config::read_map(robot.map);
  const sim_povray::SessionSettings session = config::to_robot_settings(robot, map, 1).world->session;
  const cv::Size size(robot.lower.settings.width_px, robot.lower.settings.height_px);
  const vision::OutlineRanging ranging(config::to_rig(robot), config::to_targets(map), size, size);
  const auto landmarks_m = config::to_landmark_positions(map);

  std::vector<Room> rooms;
  rooms.reserve(kRooms);
  for (int number = 0; number < kRooms; ++number) rooms.push_back(make_room(robot, map, number));

  Growth growth;
  growth.title = "Robots in one room, errors of one of them";
  growth.what = fmt::format(
      "The lab with other robots, which hide landmarks or parts of them: method `outline` on {} x {} pixels without "
      "anti-aliasing. {} draws of all places, {} poses of the measuring robot in each, the same for each number of "
      "robots; an error is the mean over a draw's fixes.",
      size.width, size.height, kRooms, kPoses);
  growth.size_name = "robots";
  Column error{"position error, mm", 2, {}};
  Column fixes{"frames with a fix, %", 0, {}, false};
  Column measured{"landmarks measured", 1, {}, false};
  for (const int robots : kRobots) {
    growth.sizes.push_back(robots);
    growth.labels.push_back(std::to_string(robots));
    for (Column* column : {&error, &fixes, &measured}) column->repeats.emplace_back();
    for (const Room& room : rooms) {
      const auto host = open(map, room, robots - 1, options);
      double sum_mm = 0;
      int fixed = 0;
      int ranges = 0;
      for (const Pose2& pose : room.poses) {
        const Seen seen = seen_at(*host, session, robot, pose);
        const auto answers = ranging.measure(seen.images.at(0), seen.images.at(1));
        ranges += ranged(answers);
        const localisation::Fix fix = estimation::fix_of_outline(answers, landmarks_m, true);
        if (!fix.position_m || fix.other_position_m) continue;
        ++fixed;
        sum_mm += 1e3 * std::hypot(fix.position_m->x() - pose.x_m, fix.position_m->y() - pose.y_m);
      }
      if (fixed > 0) error.repeats.back().push_back(sum_mm / fixed);
      fixes.repeats.back().push_back(100.0 * fixed / kPoses);
      measured.repeats.back().push_back(double(ranges) / kPoses);
    }
  }
  growth.columns = {error, fixes, measured};
  return growth;
}

}  // namespace twocone::bench
