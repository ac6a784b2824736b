// SPDX-License-Identifier: Apache-2.0
// Drives a circle and prints how far each landmark is and where the robot is: controller robots/lab_sim.yaml
#include <cstdio>

#include <twocone/twocone.h>

int main(int argc, char** argv) try {
  using namespace std::chrono_literals;
  auto robot = twocone::open_robot(argc > 1 ? argv[1] : "robot.yaml", {.stop_on_signals = true});
  twocone::Localiser localiser(robot->description());
  for (int i = 0; i < 60; ++i) {
    const auto frame = robot->next_frame(5s);  // in simulation this advances the world by one frame
    const auto report = localiser.update(*frame);
    for (const auto& range : report->ranges)
      if (range.range_m) std::printf("%s %.3f m, ", range.landmark.c_str(), *range.range_m);
    if (const auto& pose = report->fix.pose) std::printf("at (%.3f, %.3f) m\n", pose->x_m, pose->y_m);
    if (!robot->set_velocity({.forward_mps = 0.2, .turn_radps = 0.25})) return 1;
  }
} catch (const std::exception& error) {  // a wrong file, or a device: one sentence; the wheels have stopped
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
