// SPDX-License-Identifier: Apache-2.0
// A controller of one's own: drives a circle and tells what the wheels and the cameras say.
// The robot file alone decides whether the robot is simulated or real: controller robots/lab_sim.yaml
#include <cstdio>
#include <exception>

#include "apps/files/to_layers.h"
#include "drivers/backends.h"

int main(int argc, char** argv) try {
  using namespace std::chrono_literals;
  if (argc != 2) return std::fputs("usage: controller ROBOT.yaml\n", stderr), 2;
  const auto file = twocone::files::read_robot(argv[1]);
  const auto settings = twocone::files::to_robot_settings(file, twocone::files::read_map(file.map), /*seed=*/1);
  auto robot = twocone::drivers::open_robot(settings);
  if (!robot) return std::fprintf(stderr, "%s\n", robot.error().message.c_str()), 1;
  if (auto started = robot->start(settings.lower.settings, settings.upper.settings); !started) {
    return std::fprintf(stderr, "%s\n", started.error().message.c_str()), 1;
  }
  for (int i = 0; i < 6; ++i) {
    const auto frame = robot->next_frame(5s);  // in simulation this advances the world
    const auto angles = robot->drive().read_angles();
    const auto driven = robot->drive().set_speeds({.left_radps = 3, .right_radps = 4});
    if (!frame || !angles || !driven) return std::fputs("the robot fell silent\n", stderr), 1;
    const auto picture = frame->lower.image(60s);  // pixels may come later than the frame
    if (!picture) return std::fprintf(stderr, "%s\n", picture.error().message.c_str()), 1;
    std::printf("t %.3f s, wheels %.3f %.3f rad, lower view %d x %d\n", frame->lower.header().captured.seconds(),
                angles->left_rad, angles->right_rad, (*picture)->width_px, (*picture)->height_px);
  }
} catch (const std::exception& error) {  // the robot file is wrong; the wheels have stopped by now
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
