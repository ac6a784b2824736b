// SPDX-License-Identifier: Apache-2.0
// The loop of controller.py in C++: drives to the robot file's waypoints at 15 Hz by the wall clock.
//   controller ROBOT FRAMES
// Prints the processor time of the whole process and of its programs, in seconds per second.
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <thread>

#include <twocone/twocone.h>

using Clock = std::chrono::steady_clock;

static double cpu_s() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    ::getrusage(who, &used);
    sum += double(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
           1e-6 * double(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  }
  return sum;
}

int main(int, char** words) {
  auto opened = twocone::open_robot(words[1]);
  if (!opened) return std::fprintf(stderr, "controller: %s\n", opened.error().message.c_str()), 1;
  twocone::ConnectedRobot& robot = *opened;
  twocone::Localiser localiser(robot.description());
  const auto goals = robot.description().waypoints();
  std::size_t goal = 0;
  const int frames = std::atoi(words[2]);
  double begin_cpu_s = 0;
  Clock::time_point begin, next;
  for (int i = 0; i < frames; ++i) {
    const auto frame = robot.next_frame(std::chrono::seconds(60));
    const auto report = localiser.update(*frame);
    if (i == 14) begin_cpu_s = cpu_s(), begin = next = Clock::now();  // the renderer has started
    const twocone::Pose pose = report->track.value_or(report->odometry);
    const double dx_m = goals[goal].x_m - pose.x_m, dy_m = goals[goal].y_m - pose.y_m;
    if (std::hypot(dx_m, dy_m) < 0.1) goal = (goal + 1) % goals.size();
    const double ahead_rad = std::remainder(std::atan2(dy_m, dx_m) - pose.heading_rad, 2 * std::numbers::pi);
    const bool turns = std::abs(ahead_rad) > 0.5;
    const twocone::Velocity velocity{turns ? 0.0 : 0.3, turns ? std::copysign(1.0, ahead_rad) : 1.5 * ahead_rad};
    if (!robot.set_velocity(velocity)) return 1;
    if (i >= 14) std::this_thread::sleep_until(next += std::chrono::microseconds(66'667));
  }
  const double wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
  std::printf("rate %.2f cpu %.4f\n", (frames - 14) / wall_s, (cpu_s() - begin_cpu_s) / wall_s);
}
