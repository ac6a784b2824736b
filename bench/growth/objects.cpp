// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <fstream>

#include <fmt/format.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "bench/growth/growth.h"
#include "bench/growth/seen.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::bench {
namespace {

using namespace sim_povray;  // NOLINT(google-build-using-namespace): a program of its own

constexpr std::array kObjects{10, 30, 100, 300, 1000, 3000, 10'000};
constexpr std::array kPoses{Pose2{0, 0, 0}, Pose2{0.2, 0.1, 2.1}, Pose2{-0.1, 0.2, -0.7}, Pose2{-0.2, -0.1, 1.3},
                            Pose2{0.1, -0.2, 0.4}};

/// Returns the room of scenes/pair with one robot at its middle and with things around it: boxes, cylinders and
/// spheres by turns, smaller the more they are, so that they always cover about the same part of the image.
std::string scene_of(int objects) {
  const std::string parts = TWOCONE_SOURCE_DIR "/scenes/parts";
  std::string scene = fmt::format("#version 3.7;\n#include \"{0}/room.inc\"\n#include \"{0}/robot.inc\"\n", parts);
  scene += robot_at({0, 0, 0}, "//*PMName robot");
  for (const auto& [name, height] : {std::pair{"lower", 5}, std::pair{"upper", 11}}) {
    scene += fmt::format(
        "camera {{\n  //*PMName {}\n  perspective location <0, {}, 0> direction <0, 1.475, 0> up <0, 0, -1> right "
        "<4/3, 0, 0>\n  {}}}\n",
        name, height, standing_at({0, 0, 0}));
  }
  return scene + fmt::format(R"(
#declare Draw = seed(7);
#declare Size = 8 / pow({0}, 1/3);
#for (I, 1, {0})
  #local Place = vrotate(<20 + 12 * rand(Draw), 20 * rand(Draw), 0>, 360 * rand(Draw) * y);
  #switch (mod(I, 3))
    #case (0) box {{ -Size / 2, Size / 2 rotate 90 * rand(Draw) * y #break
    #case (1) cylinder {{ -y * Size / 2, y * Size / 2, Size / 2 #break
    #else sphere {{ 0, Size / 2
  #end
    translate Place pigment {{ rgb <0.3 + 0.3 * rand(Draw), 0.5, 0.5> }}
  }}
#end
)",
                             objects);
}

}  // namespace

Growth grow_objects(const Options& options) {
  config::Robot robot = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  robot = config::scaled(robot, 0.5);
  const config::Map map = config::read_map(TWOCONE_SOURCE_DIR "/scenes/pair/pair.map.yaml");
  SessionSettings session;
  session.body.radius_m = 0.1;

  Growth growth;
  growth.title = "Objects";
  growth.what = fmt::format(
      "One stereo frame of {} x {} pixels, without anti-aliasing, of a room with boxes, cylinders and spheres, which "
      "are "
      "smaller the more there are; at each of {} poses. Processor time of POV-Ray and of the native renderer for both "
      "images.",
      robot.lower.settings.width_px, robot.lower.settings.height_px, kPoses.size());
  growth.size_name = "objects";
  std::array<Column, 2> columns{Column{"POV-Ray, ms", 0, {}}, Column{"native renderer, ms", 1, {}}};
  for (const int objects : kObjects) {
    growth.sizes.push_back(objects);
    growth.labels.push_back(std::to_string(objects));
    PlaceSettings place = config::to_place(map);
    place.moving.clear();
    place.scene = options.scratch / fmt::format("objects_{}.pov", objects);
    std::ofstream(place.scene) << scene_of(objects);
    place.render.processes = 2;  // one for each view
    for (std::size_t i = 0; i < columns.size(); ++i) {
      place.render.renderer = i == 0 ? RendererKind::kPovray : RendererKind::kNative;
      const auto host = value(SimulationHost::open(place));
      (void)seen_at(*host, session, robot, kPoses.front());  // finds the mirrors, starts processes and threads
      columns[i].repeats.emplace_back();
      for (const Pose2& pose : kPoses) {
        columns[i].repeats.back().push_back(seen_at(*host, session, robot, pose).render_ms);
      }
    }
  }
  growth.columns = {columns[0], columns[1]};
  return growth;
}

}  // namespace twocone::bench
