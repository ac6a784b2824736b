// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/files/scaled_robot.h"
#include "apps/files/to_layers.h"
#include "bench/growth/growth.h"
#include "bench/growth/seen.h"
#include "drivers/sim_povray/sim_povray.h"
#include "vision/full_ranging.h"

namespace twocone::bench {
namespace {

using namespace sim_povray;  // NOLINT(google-build-using-namespace): a program of its own

constexpr std::array kHeights_px{120, 180, 240, 360, 480, 720, 960};
/// Clear of all that stands in the lab, from its middle to the arena's edge: each is one repeat.
constexpr std::array kPoses{Pose2{0, 0, 0},       Pose2{1.7, 0.3, 2.1},   Pose2{-1.7, 0.4, -0.7},
                            Pose2{0.2, 1.5, 1.3}, Pose2{0.3, -1.5, -2.6}, Pose2{-1.7, -1.2, 0.4},
                            Pose2{1.4, 1.3, -1.9}};

}  // namespace

Growth grow_pixels(const Options& options) {
  const files::Robot lab = files::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  const files::Map map = files::read_map(lab.map);
  PlaceSettings place = files::to_place(map);
  place.render.processes = 2;  // one for each view, so that a picture's figures are not another process's start
  const Venue venue = value(Venue::open(place));

  Growth growth;
  growth.title = "Pixels";
  growth.what = fmt::format(
      "One stereo frame of the lab at each of {} poses, without anti-aliasing: processor time of POV-Ray for both "
      "pictures, and of method `full` from the two pictures to ranges and bearings (median of {}, one thread). The "
      "exponents are over the pixels of a picture.",
      kPoses.size(), options.repeats);
  growth.size_name = "picture";
  Column rendering{"rendering, ms", 0, {}};
  Column vision{"vision, ms", 2, {}};
  Column measured{"landmarks measured", 0, {}, false};
  for (const int height_px : kHeights_px) {
    const files::Robot robot = files::scaled(lab, double(height_px) / lab.lower.height_px);
    const SeatSettings seat = files::to_robot_settings(robot, map, 1).world->seat;
    const cv::Size size(robot.lower.width_px, robot.lower.height_px);
    const vision::FullRanging ranging(files::to_rig(robot), files::to_targets(map), size, size);
    growth.sizes.push_back(double(size.area()));
    growth.labels.push_back(fmt::format("{} x {}", size.width, size.height));
    for (Column* column : {&rendering, &vision, &measured}) column->repeats.emplace_back();
    (void)seen_at(venue, seat, robot, kPoses.front());  // the mirrors are found and the processes started
    for (const Pose2& pose : kPoses) {
      const Seen seen = seen_at(venue, seat, robot, pose);
      rendering.repeats.back().push_back(seen.render_ms);
      std::vector<double> times_ms;
      int count = 0;
      for (int repeat = 0; repeat < options.repeats; ++repeat) {
        const double begin_s = thread_cpu_s();
        const auto answers = ranging.measure(seen.pictures.at(0), seen.pictures.at(1));
        times_ms.push_back(1e3 * (thread_cpu_s() - begin_s));
        count = ranged(answers);
      }
      vision.repeats.back().push_back(median(times_ms));
      measured.repeats.back().push_back(count);
    }
  }
  growth.columns = {rendering, vision, measured};
  return growth;
}

}  // namespace twocone::bench
