// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <fstream>
#include <future>
#include <thread>

#include <fmt/format.h>

#include "apps/config/map_file.h"
#include "apps/config/to_layers.h"
#include "bench/growth/growth.h"
#include "drivers/sim_povray/simulation.h"
#include "drivers/sim_povray/simulation_host.h"
#include "drivers/sim_povray/world/world.h"

namespace twocone::bench {
namespace {

using namespace sim_povray;  // NOLINT(google-build-using-namespace): a program of its own

constexpr std::array kRobots{1, 2, 3, 4, 6, 8};
constexpr int kSteps = 20;
constexpr int kWorldSteps = 50'000;
constexpr CameraSettings kSize{160, 120, 15};
constexpr auto kLong = std::chrono::minutes(5);
// Each robot drives round a circle of 0.15 m diameter about its place: with a body of 0.2 m it does not touch others.
constexpr WheelSpeeds kSpeeds{-1.5, 4.5};

/// The places are 0.9 m apart or more, in two rows.
Pose2 place_of(int robot) { return {-1.4 + 0.95 * (robot % 4), robot < 4 ? -0.5 : 0.5, 0.3 + 0.7 * robot}; }

/// Returns the room of scenes/pair with this number of its robots.
PlaceSettings room(int robots, const Options& options) {
  const std::string parts = TWOCONE_SOURCE_DIR "/scenes/parts";
  std::string scene = fmt::format("#version 3.7;\n#include \"{0}/room.inc\"\n#include \"{0}/robot.inc\"\n", parts);
  for (int i = 0; i < robots; ++i) {
    const Pose2 at = place_of(i);
    scene += robot_at(at, fmt::format("//*PMName robot.{}", i + 1));
    for (const auto& [name, height] : {std::pair{"lower", 5}, std::pair{"upper", 11}}) {
      scene += fmt::format(
          "camera {{\n  //*PMName {}.{}\n  perspective location <0, {}, 0> direction <0, 1.475, 0> up <0, 0, -1> right "
          "<4/3, 0, 0>\n  {}}}\n",
          name, i + 1, height, standing_at(at));
    }
  }
  PlaceSettings place = config::to_place(config::read_map(TWOCONE_SOURCE_DIR "/scenes/pair/pair.map.yaml"));
  place.moving.clear();
  place.scene = options.scratch / fmt::format("robots_{}.pov", robots);
  std::ofstream(place.scene) << scene;
  place.render.processes = options.processes;
  place.render.renderer = RendererKind::kPovray;  // the table is about its processes
  return place;
}

SessionSettings session_of(int robot) {
  SessionSettings session{.name = std::to_string(robot + 1)};
  session.body.start = place_of(robot);
  session.body.radius_m = 0.2;
  session.body.seed = std::uint64_t(robot) + 1;
  return session;
}

/// One robot with all its devices, for a separate thread.
struct Rider {
  std::unique_ptr<Simulation> simulation;
  std::unique_ptr<DiffDrive> drive;
  std::vector<std::unique_ptr<Camera>> cameras;

  Rider(SimulationHost& host, const SessionSettings& session)
      : simulation(value(Simulation::join(host, session))),
        drive(simulation->open_drive()),
        cameras(start_pair(*simulation, kSize)) {}
  void ride(int steps) {
    std::vector<Frame> frames;
    for (int i = 0; i < steps; ++i) {
      if (auto set = drive->set_speeds(kSpeeds); !set) throw std::runtime_error(set.error().message);
      for (const auto& camera : cameras) frames.push_back(value(camera->grab(kLong)));
    }
    for (const Frame& frame : frames) (void)value(frame.image(kLong));
  }
};

void all_ride(std::vector<Rider>& riders, int steps) {
  std::vector<std::future<void>> rides;
  rides.reserve(riders.size());
  for (Rider& rider : riders) rides.push_back(std::async(std::launch::async, [&rider, steps] { rider.ride(steps); }));
  for (auto& ride : rides) ride.get();
}

/// Measures the processor time of a step of the world alone, without images and threads.
double world_step_us(int robots, const PlaceSettings& place) {
  World world(place);
  world.set_rate(kSize.rate_hz);
  std::vector<World::RobotId> ids;
  ids.reserve(std::size_t(robots));
  for (int i = 0; i < robots; ++i) ids.push_back(value(world.add_robot(session_of(i).body)));
  const double begin_s = thread_cpu_s();
  for (int step = 0; step < kWorldSteps; ++step) {
    for (const auto id : ids) world.command(id, kSpeeds);
    world.step();
  }
  for (const auto id : ids) {
    if (!world.contact(id).empty()) throw std::runtime_error("a robot touches " + world.contact(id));
  }
  return 1e6 * (thread_cpu_s() - begin_s) / kWorldSteps;
}

}  // namespace

Growth grow_robots(const Options& options) {
  Growth growth;
  growth.title = fmt::format("Robots in one world, {} POV-Ray processes", options.processes);
  growth.what = fmt::format(
      "Robots that step in lock-step in one small room, each with two mirrors of {} x {} pixels; a step is one of all "
      "robots, a repeat {} steps, with {} processes at most. The world's own step: {} steps without images.",
      kSize.width_px, kSize.height_px, kSteps, options.processes, kWorldSteps);
  growth.size_name = "robots";
  Column wall{"wall time of a step, ms", 0, {}};
  Column cpu{"POV-Ray's processor time of a step, ms", 0, {}};
  Column image{"the same of an image, ms", 1, {}};
  Column world{"the world's own step, us", 2, {}};
  for (const int robots : kRobots) {
    growth.sizes.push_back(robots);
    growth.labels.push_back(std::to_string(robots));
    const PlaceSettings place = room(robots, options);
    for (Column* column : {&wall, &cpu, &image, &world}) column->repeats.emplace_back();
    const auto host = value(SimulationHost::open(place));
    std::atomic<std::int64_t> cpu_ns{0};
    std::vector<Rider> riders;
    for (int i = 0; i < robots; ++i) {
      SessionSettings session = session_of(i);
      session.rendered = [&cpu_ns](const RenderedImage& rendered) { cpu_ns += rendered.cpu.count(); };
      riders.emplace_back(*host, session);
    }
    all_ride(riders, 2);  // finds the mirrors and starts the processes
    for (int repeat = 0; repeat < options.repeats; ++repeat) {
      cpu_ns = 0;
      const double begin_s = wall_s();
      all_ride(riders, kSteps);
      wall.repeats.back().push_back(1e3 * (wall_s() - begin_s) / kSteps);
      cpu.repeats.back().push_back(1e-6 * double(cpu_ns.load()) / kSteps);
      image.repeats.back().push_back(cpu.repeats.back().back() / (2 * robots));
      world.repeats.back().push_back(world_step_us(robots, place));
    }
  }
  growth.columns = {wall, cpu, image, world};
  return growth;
}

Growth grow_robots_with_a_process_a_view(Options options) {
  options.processes = 2 * kRobots.back();
  return grow_robots(options);
}

}  // namespace twocone::bench
