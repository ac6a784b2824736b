// SPDX-License-Identifier: Apache-2.0
// Drives along the robot file's waypoints_m by its own track, and prints how far it was from the straight lines
// between them: waypoints robots/lab_sim.yaml [FRAMES]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include <twocone/twocone.h>

namespace {

/// Distance of a point from the line between two others.
double off_path_m(const twocone::Pose& at, const twocone::Pose& from, const twocone::Pose& to) {
  const double dx = to.x_m - from.x_m, dy = to.y_m - from.y_m;
  const double along = ((at.x_m - from.x_m) * dx + (at.y_m - from.y_m) * dy) / (dx * dx + dy * dy);
  const double share = std::clamp(along, 0.0, 1.0);
  return std::hypot(at.x_m - from.x_m - share * dx, at.y_m - from.y_m - share * dy);
}

}  // namespace

int main(int argc, char** argv) try {
  using namespace std::chrono_literals;
  if (argc < 2) return std::fputs("usage: waypoints ROBOT.yaml [FRAMES]\n", stderr), 2;
  const int frames = argc > 2 ? std::atoi(argv[2]) : 300;
  auto robot = twocone::open_robot(argv[1], {.stop_on_signals = true});
  if (!robot) return std::fprintf(stderr, "%s\n", robot.error().message.c_str()), 1;
  twocone::Localiser localiser(robot->description());
  const auto waypoints = robot->description().waypoints();
  if (waypoints.empty()) return std::fputs("the robot file has no waypoints_m\n", stderr), 1;

  twocone::Pose from = robot->description().start();
  std::size_t next = 0;
  double worst_m = 0, sum_m2 = 0;
  int judged = 0, without_track = 0;
  for (int i = 0; i < frames; ++i) {
    const auto frame = robot->next_frame(5s);
    if (!frame) return std::fprintf(stderr, "%s\n", frame.error().message.c_str()), 1;
    const auto report = localiser.update(*frame);
    if (!report) return std::fprintf(stderr, "%s\n", report.error().message.c_str()), 1;
    const twocone::Pose at = report->track.value_or(report->odometry);
    without_track += !report->track;
    const twocone::Pose& to = waypoints[next % waypoints.size()];
    if (const auto truth = robot->true_pose()) {  // a simulation: how well did it drive?
      const double off_m = off_path_m(*truth, from, to);
      worst_m = std::max(worst_m, off_m);
      sum_m2 += off_m * off_m;
      ++judged;
    }
    if (std::hypot(to.x_m - at.x_m, to.y_m - at.y_m) < 0.05) {
      from = to;
      ++next;
      continue;
    }
    const double aside_rad =
        std::remainder(std::atan2(to.y_m - at.y_m, to.x_m - at.x_m) - at.heading_rad, 2 * std::numbers::pi);
    const bool turns = std::abs(aside_rad) > 0.3;  // on the spot first, else it cuts the corner
    const auto driven =
        robot->set_velocity({.forward_mps = turns ? 0.0 : 0.25, .turn_radps = std::clamp(3 * aside_rad, -1.5, 1.5)});
    if (!driven) return std::fprintf(stderr, "%s\n", driven.error().message.c_str()), 1;
  }
  std::printf("%d frames, %zu waypoints reached, %d frames without a track\n", frames, next, without_track);
  if (judged > 0) {
    std::printf("off the path: rms %.1f mm, at most %.1f mm\n", 1e3 * std::sqrt(sum_m2 / judged), 1e3 * worst_m);
  }
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
