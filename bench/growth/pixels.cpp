// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "bench/growth/growth.h"
#include "bench/growth/seen.h"
#include "drivers/sim_povray/simulation_host.h"
#include "vision/outline_ranging.h"

namespace twocone::bench {
namespace {

using namespace sim_povray;  // NOLINT(google-build-using-namespace): a program of its own

constexpr std::array kHeights_px{120, 180, 240, 360, 480, 720, 960};
/// Free poses in the lab, from its middle to the arena's edge: each is one repeat.
constexpr std::array kPoses{Pose2{0, 0, 0},       Pose2{1.7, 0.3, 2.1},   Pose2{-1.7, 0.4, -0.7},
                            Pose2{0.2, 1.5, 1.3}, Pose2{0.3, -1.5, -2.6}, Pose2{-1.7, -1.2, 0.4},
                            Pose2{1.4, 1.3, -1.9}};

}  // namespace

Growth grow_pixels(const Options& options) {
  const config::Robot lab = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  const config::Map map = config::read_map(lab.map);
  PlaceSettings place = config::to_place(map);
  place.render.processes = 2;  // one for each view: an image's figures must not include the start of another process
  place.render.renderer = RendererKind::kPovray;
  const auto host = value(SimulationHost::open(place));
  place.render.renderer = RendererKind::kNative;
  const auto native_host = value(SimulationHost::open(place));

  Growth growth;
  growth.title = "Pixels";
  growth.what = fmt::format(
      "One stereo frame of the lab at each of {} poses, without anti-aliasing: processor time of POV-Ray and of "
      "the native renderer for both images, and of method `outline` from the two images to ranges and bearings (median "
      "of {}, one thread). The "
      "exponents are over the pixels of an image.",
      kPoses.size(), options.repeats);
  growth.size_name = "image";
  Column rendering{"POV-Ray, ms", 0, {}};
  Column native{"native renderer, ms", 1, {}};
  Column vision{"vision, ms", 2, {}};
  Column measured{"landmarks measured", 0, {}, false};
  for (const int height_px : kHeights_px) {
    const config::Robot robot = config::scaled(lab, double(height_px) / lab.lower.settings.height_px);
    const SessionSettings session = config::to_robot_settings(robot, map, 1).world->session;
    const cv::Size size(robot.lower.settings.width_px, robot.lower.settings.height_px);
    const vision::OutlineRanging ranging(config::to_rig(robot), config::to_targets(map), size, size);
    growth.sizes.push_back(double(size.area()));
    growth.labels.push_back(fmt::format("{} x {}", size.width, size.height));
    for (Column* column : {&rendering, &native, &vision, &measured}) column->repeats.emplace_back();
    // The first image finds the mirrors and starts processes and threads.
    for (SimulationHost* renders : {host.get(), native_host.get()})
      (void)seen_at(*renders, session, robot, kPoses.front());
    for (const Pose2& pose : kPoses) {
      const Seen seen = seen_at(*host, session, robot, pose);
      rendering.repeats.back().push_back(seen.render_ms);
      native.repeats.back().push_back(seen_at(*native_host, session, robot, pose).render_ms);
      std::vector<double> times_ms;
      int count = 0;
      for (int repeat = 0; repeat < options.repeats; ++repeat) {
        const double begin_s = thread_cpu_s();
        const auto answers = ranging.measure(seen.images.at(0), seen.images.at(1));
        times_ms.push_back(1e3 * (thread_cpu_s() - begin_s));
        count = ranged(answers);
      }
      vision.repeats.back().push_back(median(times_ms));
      measured.repeats.back().push_back(count);
    }
  }
  growth.columns = {rendering, native, vision, measured};
  return growth;
}

}  // namespace twocone::bench
