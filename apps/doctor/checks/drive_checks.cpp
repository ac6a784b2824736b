// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/doctor/checks/wheel_bench.h"
#include "base/quantile.h"

namespace twocone::doctor {
namespace {

constexpr int kReadings = 50;
constexpr double kBetweenReadings_s = 0.02;
// More than half a frame period leaves too little time for vision and steering.
constexpr double kSlowShare = 0.5;
constexpr double kManyFailed = 0.2;

/// The answers of a drive to repeated readings.
struct Readings {
  std::vector<double> times_s;  ///< of the readings that were answered
  std::optional<WheelAngles> first, last;
  int failed = 0;
  std::optional<Error> error;  ///< the last one
};

Readings read_often(DiffDrive& drive, const Surroundings& surroundings) {
  Readings readings;
  for (int i = 0; i < kReadings; ++i) {
    end_if_asked(surroundings);
    const double begin_s = surroundings.now_s();
    if (const auto angles = drive.read_angles()) {
      readings.times_s.push_back(surroundings.now_s() - begin_s);
      if (!readings.first) readings.first = *angles;
      readings.last = *angles;
    } else {
      ++readings.failed;
      readings.error = angles.error();
      if (readings.failed > kReadings / 2) break;  // each may take as long as its time-out
    }
    surroundings.progress("drive", double(i) / kReadings);
    surroundings.sleep(nanoseconds_of(kBetweenReadings_s));
  }
  return readings;
}

Row judge_readings(const Readings& readings, double period_s) {
  if (readings.times_s.empty()) return drive_failed("angles", *readings.error);
  const int all = readings.failed + int(readings.times_s.size());
  Row row{kDrivePart, "angles",
          fmt::format("{:.1f} ms, at most {:.1f} ms; {} of {} failed", 1e3 * base::quantile(readings.times_s, 0.5),
                      1e3 * std::ranges::max(readings.times_s), readings.failed, all)};
  if (readings.failed > 0) {
    row.judge(readings.failed > kManyFailed * all ? kFailed : kWarning,
              fmt::format("{}: {}", readings.error->message, drive_advice(readings.error->code)));
  } else if (base::quantile(readings.times_s, 0.5) > kSlowShare * period_s) {
    row.judge(kWarning, "slow for this frame rate: use a higher baud; for FTDI adapters set latency_timer 1");
  }
  return row;
}

Row judge_standing(const Readings& readings, double still_rad) {
  const double moved_rad = std::max(std::abs(readings.last->left_rad - readings.first->left_rad),
                                    std::abs(readings.last->right_rad - readings.first->right_rad));
  Row row{kDrivePart, "standing still", fmt::format("the angles moved by {:.3f} rad in a second", moved_rad)};
  if (moved_rad > still_rad) {
    row.judge(
        kFailed,
        "the wheels turn without a command: hold them still; check the encoders' wiring and the controller's program");
  }
  return row;
}

/// Judges the means that stop the wheels if the program fails: the controller's own time-out, or the watchdog.
Row judge_timeout(const DriveFacts& facts, const DriveLimits& limits) {
  const std::string own =
      facts.own_timeout ? fmt::format("own {:.1f} s", seconds_of(*facts.own_timeout)) : std::string("none of its own");
  Row row{kDrivePart, "time-out",
          fmt::format("{}, watchdog {}; command_timeout_s {:g}", own, facts.has_watchdog ? "on" : "off",
                      seconds_of(limits.command_timeout))};
  const bool stops_itself = facts.own_timeout && *facts.own_timeout <= limits.command_timeout;
  if (!stops_itself && !facts.has_watchdog) {
    row.judge(kFailed, "nothing stops the wheels in time when the program dies: set watchdog: true");
  }
  return row;
}

// ---- the two ways of stopping

constexpr const char* kCommanded = "stop, commanded";
constexpr const char* kSilent = "stop, silence";
constexpr double kDriveTime_s = 1;
constexpr double kGrace_s = 0.1;
// In this time after the limit, a wheel that was not stopped turns by far more than the uncertainty.
constexpr double kBeyond_s = 0.2;
constexpr double kBetweenLooks_s = 0.3;
constexpr double kWatch_s = 2;

/// Returns the time in seconds from `stop_s` until the wheels stood still, to the resolution of two samples. Returns
/// nothing if they still turned at the last sample.
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

/// @param stop_s nothing: the wheels turned until the end of the observation
Row judge_stop(const char* check, const std::optional<double>& stop_s, const DriveLimits& limits) {
  const double limit_s = seconds_of(limits.command_timeout) + kGrace_s;
  const char* const advice =
      check == std::string_view(kCommanded)
          ? "the controller brakes late or the wheels coast: change its brake setting, or set a longer "
            "command_timeout_s"
          : "do not drive it: set watchdog: true, the controller's own time-out, or a longer command_timeout_s";
  if (!stop_s) {
    return {kDrivePart, check, fmt::format("they continue to turn, must stand still within {:.2f} s", limit_s), kFailed,
            advice};
  }
  Row row{kDrivePart, check, fmt::format("{:.2f} s, at most {:.2f} s", *stop_s, limit_s)};
  if (*stop_s > limit_s) {
    row.judge(kFailed, advice);
  }
  return row;
}

double mean_rad(const WheelSample& sample) { return (sample.left_rad + sample.right_rad) / 2; }

/// Returns the mean speed of both wheels, over the second half of the course.
double mean_speed(const Course& course) {
  const WheelSample& from = course.samples[course.samples.size() / 2];
  const WheelSample& to = course.samples.back();
  return to.t_s > from.t_s ? (mean_rad(to) - mean_rad(from)) / (to.t_s - from.t_s) : 0;
}

Row course_failed(const char* check, const Course& course) {
  if (course.error) return drive_failed(check, *course.error);
  return {kDrivePart, check, "the wheels ran away", kFailed, "see the wheels' rows"};
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
  if (!(speed > 0)) return {kDrivePart, kSilent, "the wheels did not turn", kFailed, "see the wheels' rows"};
  std::optional<double> ran_s;
  if (std::abs(mean_rad(*second) - mean_rad(*first)) <= bench.still_rad()) {
    const WheelSample& last = course.samples.back();
    ran_s = (mean_rad(*first) - mean_rad(last)) / speed + last.t_s - course.last_command_s;
  }
  return judge_stop(kSilent, ran_s, test.asked.limits);
}

/// Tests both ways of stopping from a moderate speed: by a command, and by silence. In the second test, the angles are
/// not read until the wheels must stand still, because a reading may make a driver stop them. The running time is the
/// angle that they turned divided by their speed. Half of the time of even coasting is therefore counted.
void test_stopping(const DriveUnderTest& test, DiffDrive& drive, WheelBench& bench, const Surroundings& surroundings,
                   Report& report) {
  end_if_asked(surroundings);
  report.add(test_commanded(test, drive, bench));
  bench.halt();
  report.add(test_silent(test, bench));
  bench.halt();
}

}  // namespace

bool check_standing_drive(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings,
                          Report& report) {
  const DriveFacts facts = drive.facts();
  report.add(
      {kDrivePart, "controller",
       fmt::format("{}, {}{}", facts.controller, facts.device,
                   facts.counts_per_turn > 0 ? fmt::format(", {:g} counts per turn", facts.counts_per_turn) : "")});
  report.add(judge_timeout(facts, test.asked.limits));
  const Readings readings = read_often(drive, surroundings);
  const Row heard = judge_readings(readings, test.period_s);
  report.add(heard);
  if (!readings.last) return false;
  const Row standing = judge_standing(readings, still_rad(facts.counts_per_turn));
  report.add(standing);
  return standing.verdict == kOk && heard.verdict != kFailed;
}

Permission ask_off_the_ground(bool was_stated, const Surroundings& surroundings, Report& report) {
  if (was_stated) return Permission::kGiven;
  const auto not_run = [&](std::string measured, std::string advice) {
    report.add({kDrivePart, "moving tests", std::move(measured), kNotRun, std::move(advice)});
    return Permission::kRefused;
  };
  if (!surroundings.ask) {
    return not_run("no user can confirm that the wheels are free",
                   "lift both wheels; run it in a terminal, or with --wheels-off-the-ground");
  }
  const auto answer = surroundings.ask("Are both wheels off the ground and free? [yes/no] ");
  end_if_asked(surroundings);
  if (answer == "yes") return Permission::kGiven;
  return not_run("the wheels are not off the ground", "lift both wheels, run it again and answer yes");
}

void check_wheels(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings, Report& report) {
  WheelBench bench(drive, drive.facts().counts_per_turn, surroundings);
  if (!test_turning(test, bench, surroundings, report)) {
    return report.add({kDrivePart, "stop time", "the wheels do not obey yet", kNotRun, "see the wheels' rows"});
  }
  test_least_speed(test, bench, surroundings, report);
  test_counts_per_turn(test, bench, drive.facts().counts_per_turn, surroundings, report);
  test_stopping(test, drive, bench, surroundings, report);
}

}  // namespace twocone::doctor
