// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/drive_checks.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/doctor/advice.h"
#include "apps/doctor/checks/stop_tests.h"
#include "apps/doctor/checks/turn_tests.h"
#include "apps/doctor/statistics.h"
#include "apps/doctor/wheel_bench.h"

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
          fmt::format("{:.1f} ms, at most {:.1f} ms; {} of {} failed", 1e3 * median(readings.times_s),
                      1e3 * greatest(readings.times_s), readings.failed, all)};
  if (readings.failed > 0) {
    row.judge(readings.failed > kManyFailed * all ? Verdict::kFailed : Verdict::kWarning,
              fmt::format("{}: {}", readings.error->message, drive_advice(readings.error->code)));
  } else if (median(readings.times_s) > kSlowShare * period_s) {
    row.judge(Verdict::kWarning, "slow for this frame rate: use a higher baud; for FTDI adapters set latency_timer 1");
  }
  return row;
}

Row judge_standing(const Readings& readings, double still_rad) {
  const double moved_rad = std::max(std::abs(readings.last->left_rad - readings.first->left_rad),
                                    std::abs(readings.last->right_rad - readings.first->right_rad));
  Row row{kDrivePart, "standing still", fmt::format("the angles moved by {:.3f} rad in a second", moved_rad)};
  if (moved_rad > still_rad) {
    row.judge(
        Verdict::kFailed,
        "the wheels turn without a command: hold them still; check the encoders' wiring and the controller's program");
  }
  return row;
}

}  // namespace

Row judge_timeout(const DriveFacts& facts, const DriveLimits& limits) {
  const std::string own =
      facts.own_timeout ? fmt::format("own {:.1f} s", seconds_of(*facts.own_timeout)) : std::string("none of its own");
  Row row{kDrivePart, "time-out",
          fmt::format("{}, watchdog {}; command_timeout_s {:g}", own, facts.has_watchdog ? "on" : "off",
                      seconds_of(limits.command_timeout))};
  const bool stops_itself = facts.own_timeout && *facts.own_timeout <= limits.command_timeout;
  if (!stops_itself && !facts.has_watchdog) {
    row.judge(Verdict::kFailed, "nothing stops the wheels in time when the program dies: set watchdog: true");
  }
  return row;
}

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
  return standing.verdict == Verdict::kOk && heard.verdict != Verdict::kFailed;
}

Permission ask_off_the_ground(bool was_stated, const Surroundings& surroundings, Report& report) {
  if (was_stated) return Permission::kGiven;
  const auto not_run = [&](std::string measured, std::string advice) {
    report.add({kDrivePart, "moving tests", std::move(measured), Verdict::kNotRun, std::move(advice)});
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
    report.add({kDrivePart, "stop time", "the wheels do not obey yet", Verdict::kNotRun, "see the wheels' rows"});
    return;
  }
  test_least_speed(test, bench, surroundings, report);
  test_counts_per_turn(test, bench, drive.facts().counts_per_turn, surroundings, report);
  test_stopping(test, drive, bench, surroundings, report);
}

}  // namespace twocone::doctor
