// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/stop_tests.h"

#include <cmath>

#include <fmt/format.h>

#include "apps/doctor/advice.h"

namespace twocone::doctor {
namespace {

constexpr const char* kCommanded = "stop, commanded";
constexpr const char* kSilent = "stop, silence";
constexpr double kDriveTime_s = 1;
constexpr double kGrace_s = 0.1;
// At this time after the limit, a wheel that was not stopped has turned far more than the uncertainty.
constexpr double kBeyond_s = 0.2;
constexpr double kBetweenLooks_s = 0.3;
constexpr double kWatch_s = 2;

double mean_rad(const WheelSample& sample) { return (sample.left_rad + sample.right_rad) / 2; }

/// Returns the mean speed of both wheels, over the second half of the course.
double mean_speed(const Course& course) {
  const WheelSample& from = course.samples[course.samples.size() / 2];
  const WheelSample& to = course.samples.back();
  return to.t_s > from.t_s ? (mean_rad(to) - mean_rad(from)) / (to.t_s - from.t_s) : 0;
}

Row course_failed(const char* check, const Course& course) {
  if (course.error) return drive_failed(check, *course.error);
  return {kDrivePart, check, "the wheels ran away", Verdict::kFailed, "see the wheels' rows"};
}

Row test_commanded(const DriveUnderTest& test, DiffDrive& drive, WheelBench& bench) {
  const Course course = bench.drive({bench.speed_radps(), bench.speed_radps()}, kDriveTime_s, kCommanded);
  if (!course.is_whole()) return course_failed(kCommanded, course);
  const Result<WheelSample> before = bench.read();
  if (!before) return drive_failed(kCommanded, before.error());
  const double stop_s = before->t_s;
  if (const auto stopped = drive.stop(); !stopped) {
    return drive_failed(kCommanded, stopped.error());
  }
  const Course watched = bench.watch(seconds_of(test.asked.limits.command_timeout) + kWatch_s);
  if (watched.error) return course_failed(kCommanded, watched);
  return judge_stop(kCommanded, stop_time_after(stop_s, watched, bench.still_rad()), test.asked.limits);
}

Row test_silent(const DriveUnderTest& test, WheelBench& bench) {
  const double timeout_s = seconds_of(test.asked.limits.command_timeout);
  const Course course = bench.drive({bench.speed_radps(), bench.speed_radps()}, kDriveTime_s, kSilent);
  if (!course.is_whole()) return course_failed(kSilent, course);
  const double speed = mean_speed(course);
  bench.wait(timeout_s + kGrace_s + kBeyond_s);
  const auto first = bench.read();
  if (!first) return drive_failed(kSilent, first.error());
  bench.wait(kBetweenLooks_s);
  const auto second = bench.read();
  bench.halt();
  if (!second) return drive_failed(kSilent, second.error());
  if (!(speed > 0)) return {kDrivePart, kSilent, "the wheels did not turn", Verdict::kFailed, "see the wheels' rows"};
  std::optional<double> ran_s;
  if (std::abs(mean_rad(*second) - mean_rad(*first)) <= bench.still_rad()) {
    const WheelSample& last = course.samples.back();
    ran_s = (mean_rad(*first) - mean_rad(last)) / speed + last.t_s - course.last_command_s;
  }
  return judge_stop(kSilent, ran_s, test.asked.limits);
}

}  // namespace

std::optional<double> stop_time_after(double stop_s, const Course& watched, double still_rad) {
  if (watched.samples.size() < 2) return std::nullopt;
  const WheelSample& last = watched.samples.back();
  const auto stands_still = [&](const WheelSample& sample) {
    return std::abs(sample.left_rad - last.left_rad) <= still_rad &&
           std::abs(sample.right_rad - last.right_rad) <= still_rad;
  };
  auto first = watched.samples.end() - 1;
  while (first != watched.samples.begin() && stands_still(*(first - 1))) --first;
  // Two consecutive samples are near each other at any speed.
  constexpr double kStill_s = 0.1;
  if (last.t_s - first->t_s < kStill_s) return std::nullopt;
  return std::max(0.0, first->t_s - stop_s);
}

Row judge_stop(const char* check, const std::optional<double>& stop_s, const DriveLimits& limits) {
  const double limit_s = seconds_of(limits.command_timeout) + kGrace_s;
  const char* const advice =
      check == std::string_view(kCommanded)
          ? "the controller brakes late or the wheels coast: change its brake setting, or set a longer "
            "command_timeout_s"
          : "do not drive it: set watchdog: true, the controller's own time-out, or a longer command_timeout_s";
  if (!stop_s) {
    return {kDrivePart, check, fmt::format("they continue to turn, must stand still within {:.2f} s", limit_s),
            Verdict::kFailed, advice};
  }
  Row row{kDrivePart, check, fmt::format("{:.2f} s, at most {:.2f} s", *stop_s, limit_s)};
  if (*stop_s > limit_s) {
    row.judge(Verdict::kFailed, advice);
  }
  return row;
}

void test_stopping(const DriveUnderTest& test, DiffDrive& drive, WheelBench& bench, const Surroundings& surroundings,
                   Report& report) {
  end_if_asked(surroundings);
  report.add(test_commanded(test, drive, bench));
  bench.halt();
  report.add(test_silent(test, bench));
  bench.halt();
}

}  // namespace twocone::doctor
