// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/doctor/checks/wheel_bench.h"
#include "drivers/memory/memory.h"
#include "tests/doctor/bench_devices.h"
#include "tests/support/faulty_diffdrive.h"

namespace twocone::doctor {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

constexpr double kPeriod_s = 0.04;

/// The user's answers: the left wheel, then the right one, and the number of turns.
struct Eyes {
  std::string left = "lf", right = "rf", turns = "5";
};

std::function<std::optional<std::string>(const std::string&)> person_with(const Eyes& eyes) {
  return [eyes, wheel = 0](const std::string& question) mutable -> std::optional<std::string> {
    if (question.find("Which wheel") != std::string::npos) return wheel++ == 0 ? eyes.left : eyes.right;
    if (question.find("How many") != std::string::npos) return eyes.turns;
    if (question.find("off the ground") != std::string::npos) return "yes";
    return "";
  };
}

drivers::DrivePart part_of(const DriveTruth& truth) {
  serial::SerialDriveSettings serial;
  serial.protocol = "ros_arduino_bridge";
  serial.counts_per_turn = truth.counts_per_turn;
  return {"serial_diffdrive", truth.limits, serial};
}

/// Checks the standing drive and, if it is in order, the wheels.
Report checked(const DriveTruth& truth, const std::optional<Eyes>& eyes) {
  FakeSurroundings fake;
  if (eyes) fake.person = person_with(*eyes);
  const auto log = std::make_shared<WheelLog>();
  BenchDrive drive(fake.clock, truth, log);
  const DriveUnderTest test{part_of(truth), kPeriod_s};
  Report report;
  const Surroundings surroundings = fake.surroundings();
  if (check_standing_drive(test, drive, surroundings, report)) {
    EXPECT_EQ(log->moves, 0) << "commands to a standing drive";
    check_wheels(test, drive, surroundings, report);
    EXPECT_GT(log->stops, 0);
  }
  return report;
}

struct DriveCase {
  const char* name;
  DriveTruth truth;
  std::optional<Eyes> eyes;
  const char* check;
  Verdict verdict;
  const char* advice;
};
void PrintTo(const DriveCase& c, std::ostream* out) { *out << c.name; }

class Drives : public testing::TestWithParam<DriveCase> {};

TEST_P(Drives, AreJudged) {
  const DriveCase& c = GetParam();
  const Report report = checked(c.truth, c.eyes);
  const Row row = row_of(report, "drive", c.check);
  EXPECT_EQ(row.verdict, c.verdict) << row.check << ": " << row.measured;
  EXPECT_THAT(row.advice, HasSubstr(c.advice)) << row.measured;
}

const DriveTruth kBothCrossed{.motors_crossed = true, .encoders_crossed = true};
const DriveTruth kBothBackward{.left_motor_backward = true, .left_encoder_backward = true};

const DriveCase kStandingDriveCases[] = {
    {"nothing_stops_it", {.own_timeout = {}, .has_watchdog = false}, {}, "time-out", kFailed, "watchdog"},
    {"its_own_is_longer", {.own_timeout = 2000ms, .has_watchdog = false}, {}, "time-out", kFailed, "watchdog"},
    {"the_watchdog_is_enough", {.own_timeout = {}}, {}, "time-out", kOk, ""},
    {"its_own_is_enough", {.has_watchdog = false}, {}, "time-out", kOk, ""},
    {"silent", {.silent_after = 0}, {}, "angles", kFailed, "power"},
    {"answers_seldom", {.lose_every = 3}, {}, "angles", kFailed, "no answer"},
    {"answers_mostly", {.lose_every = 20}, {}, "angles", kWarning, "no answer"},
    {"slow", {.read_takes_s = 0.027}, {}, "angles", kWarning, "baud"},
    {"creeps", {.creep_radps = 0.3}, {}, "standing still", kFailed, "without a command"}};

INSTANTIATE_TEST_SUITE_P(Standing, Drives, testing::ValuesIn(kStandingDriveCases),
                         [](const auto& each) { return each.param.name; });

const DriveCase kMovingDriveCases[] = {
    // Motors and encoders are exchanged together: only the user can see it, and the file's keys correct it.
    {"swapped", kBothCrossed, Eyes{"rf", "lf"}, "left wheel", kFailed, "swap_wheels: true"},
    {"swapped_right", kBothCrossed, Eyes{"rf", "lf"}, "right wheel", kFailed, "swap_wheels: true"},
    {"reversed", kBothBackward, Eyes{"left backward", "rf"}, "left wheel", kFailed, "reverse_left: true"},
    {"other_is_fine", kBothBackward, Eyes{"lb", "rf"}, "right wheel", kOk, ""},
    {"swapped_unseen", kBothCrossed, {}, "wheels seen", kNotRun, "terminal"},
    // No key helps where an encoder does not measure its own motor.
    {"encoders_crossed", {.encoders_crossed = true}, Eyes{}, "left wheel", kFailed, "encoders' plugs"},
    {"motors_crossed", {.motors_crossed = true}, Eyes{"rf", "lf"}, "left wheel", kFailed, "motors' plugs"},
    {"crossed_unseen", {.motors_crossed = true}, {}, "left wheel", kFailed, "crossed"},
    {"encoder_backward", {.left_encoder_backward = true}, Eyes{}, "left wheel", kFailed, "A and B"},
    {"motor_backward", {.left_motor_backward = true}, Eyes{"lb", "rf"}, "left wheel", kFailed, "two leads"},
    {"backward_unseen", {.left_motor_backward = true}, {}, "left wheel", kFailed, "two leads"},
    {"not_counted", {.left_encoder_dead = true}, Eyes{}, "left wheel", kFailed, "encoder's plug"},
    {"no_motion", {.speed_factor = 0}, {}, "left wheel", kFailed, "power"},
    {"no_motion_no_stop", {.speed_factor = 0}, {}, "stop time", kNotRun, "rows"},
    {"both_turn", {.both_turn = true}, {}, "left wheel", kFailed, "both turn"},
    {"runs_away", {.speed_factor = 5}, {}, "left wheel", kFailed, "PID"},
    {"a_little_slow", {.speed_factor = 0.85}, {}, "right speed", kWarning, "PID"},
    {"far_too_slow", {.speed_factor = 0.6}, {}, "right speed", kFailed, "battery"},
    {"turns_slowly", {}, {}, "least speed", kOk, ""},
    {"turns_only_fast", {.least_radps = 0.7}, {}, "least speed", kWarning, "least_speed_radps: 0.81"},
    {"turns_right", {}, Eyes{"", "", "5.1"}, "counts per turn", kOk, ""},
    {"turns_wrong", {}, Eyes{"lf", "rf", "4.0"}, "counts per turn", kFailed, "counts_per_turn: 1249"},
    {"turns_not_seen", {}, Eyes{"lf", "rf", ""}, "counts per turn", kNotRun, "again"},
    {"turns_no_number", {}, Eyes{"lf", "rf", "five"}, "counts per turn", kNotRun, "again"},
    {"turns_nobody", {}, {}, "counts per turn", kNotRun, "terminal"},
    {"stops_late", {.stop_takes_s = 0.71, .silence_takes_s = 5}, {}, "stop, commanded", kFailed, "brake"},
    {"stops_in_time", {.stop_takes_s = 0.31}, {}, "stop, commanded", kOk, ""},
    {"stops_never", {.stop_takes_s = 1e6, .silence_takes_s = 1e6}, {}, "stop, commanded", kFailed, "brake"},
    {"silence_in_time", {.silence_takes_s = 0.56}, {}, "stop, silence", kOk, ""},
    {"silence_late", {.silence_takes_s = 0.66}, {}, "stop, silence", kFailed, "do not drive"},
    {"silence_never", {.silence_takes_s = 1e6}, {}, "stop, silence", kFailed, "do not drive"},
    {"falls_silent", {.silent_after = 120}, {}, "left wheel", kFailed, "power"}};

INSTANTIATE_TEST_SUITE_P(Moving, Drives, testing::ValuesIn(kMovingDriveCases),
                         [](const auto& each) { return each.param.name; });

TEST(DoctorDrive, ThatIsInOrderIsOk) {
  const Report report = checked({}, Eyes{});
  EXPECT_EQ(report.count(kOk), report.rows().size()) << table(report);
  EXPECT_THAT(row_of(report, "drive", "stop, silence").measured, HasSubstr("0.5"));
}

TEST(DoctorDrive, MeasuredStopTimesAreTheRealOnes) {
  const Report report = checked({.stop_takes_s = 0.23, .silence_takes_s = 0.41}, {});
  // By a command: the resolution of a reading (5 + 4 ms). By silence: the precision of the speed.
  constexpr double kTolerance_s = 0.025;
  EXPECT_NEAR(std::stod(row_of(report, "drive", "stop, commanded").measured), 0.23, kTolerance_s);
  EXPECT_NEAR(std::stod(row_of(report, "drive", "stop, silence").measured), 0.41, kTolerance_s);
}

TEST(DoctorDrive, WheelsStandAfterEveryFailure) {
  for (const DriveTruth& truth : {DriveTruth{}, DriveTruth{.speed_factor = 5}, DriveTruth{.left_motor_backward = true},
                                  DriveTruth{.silence_takes_s = 1e6}}) {
    FakeSurroundings fake;
    const auto log = std::make_shared<WheelLog>();
    BenchDrive drive(fake.clock, truth, log);
    Report report;
    check_wheels({part_of(truth), kPeriod_s}, drive, fake.surroundings(), report);
    EXPECT_FALSE(log->turn);
  }
}

TEST(DoctorDrive, WheelsStandAfterAnInterruption) {
  // The interruption comes at every moment of the tests.
  bool was_done = false;
  for (int sleeps = 3; !was_done; sleeps += 37) {
    FakeSurroundings fake;
    int left = sleeps;
    fake.at_each_sleep = [&] { fake.stop = fake.stop || --left == 0; };
    const auto log = std::make_shared<WheelLog>();
    BenchDrive drive(fake.clock, {}, log);
    Report report;
    try {
      check_wheels({part_of({}), kPeriod_s}, drive, fake.surroundings(), report);
      was_done = true;
    } catch (const Interrupted&) {
      EXPECT_LE(left, 0);
    }
    EXPECT_FALSE(log->turn) << "after " << sleeps << " sleeps";
    EXPECT_GT(log->stops, 0);
  }
}

TEST(DoctorDrive, ABadCableIsReported) {
  FakeSurroundings fake;
  testing_support::DriveFaults faults;
  faults.read_timeout_chance = 0.1;
  testing_support::FaultyDiffDrive drive(std::make_unique<memory::MemoryDiffDrive>(fake.clock, DriveLimits{}), faults,
                                         7);
  Report report;
  check_standing_drive({part_of({}), kPeriod_s}, drive, fake.surroundings(), report);
  EXPECT_EQ(row_of(report, "drive", "angles").verdict, kWarning);
}

TEST(DoctorDrive, OnlyYesPermits) {
  for (const char* answer : {"", "y", "no", "Yes", "yes please", "off"}) {
    FakeSurroundings fake;
    fake.person = [answer](const std::string&) { return answer; };
    Report report;
    EXPECT_EQ(ask_off_the_ground(false, fake.surroundings(), report), Permission::kRefused) << answer;
    EXPECT_EQ(row_of(report, "drive", "moving tests").verdict, kNotRun);
  }
  FakeSurroundings fake;
  Report report;
  fake.person = [](const std::string&) { return std::nullopt; };
  EXPECT_EQ(ask_off_the_ground(false, fake.surroundings(), report), Permission::kRefused) << "no answer";
  fake.person = [](const std::string&) { return "yes"; };
  EXPECT_EQ(ask_off_the_ground(false, fake.surroundings(), report), Permission::kGiven);
  fake.asked.clear();
  EXPECT_EQ(ask_off_the_ground(true, fake.surroundings(), report), Permission::kGiven);
  EXPECT_TRUE(fake.asked.empty()) << "it was stated";
}

TEST(DoctorTurning, AnswersAreUnderstood) {
  using enum Side;
  EXPECT_EQ(parse_turning("lf"), (Turning{kLeft, true}));
  EXPECT_EQ(parse_turning("right, backward"), (Turning{kRight, false}));
  EXPECT_EQ(parse_turning("right back"), (Turning{kRight, false}));
  EXPECT_EQ(parse_turning("left forwards"), (Turning{kLeft, true}));
  for (const char* text : {"", "l", "left", "f", "xf", "lx", "forward", "no"}) {
    EXPECT_EQ(parse_turning(text), std::nullopt) << text;
  }
}

TEST(DoctorAdvice, OfARefusalComesFromItsMessage) {
  const Row row = failed_row("drive", "opens",
                             {ErrorCode::kRefused, "drive: /dev/null is no serial port; name the port; or another"},
                             drive_advice(ErrorCode::kRefused));
  EXPECT_EQ(row.measured, "/dev/null is no serial port");
  EXPECT_EQ(row.advice, "name the port; or another");
  const Row silent = failed_row("drive", "opens", {ErrorCode::kTimeout, "no answer; nothing came"}, "power");
  EXPECT_EQ(silent.measured, "no answer; nothing came");
  EXPECT_EQ(silent.advice, "power") << "only a refusal states its own remedy";
}

TEST(DoctorTurning, AdviceReversesKeysThatAreSet) {
  serial::SerialDriveSettings settings;
  settings.swap_wheels = settings.reverse_right = true;
  const Counted right{.left_rad = 0, .right_rad = 6, .commanded_rad = 6};
  EXPECT_EQ(judge_turning(Side::kRight, right, Turning{Side::kLeft, true}, settings).advice, "swap_wheels: false");
  EXPECT_EQ(judge_turning(Side::kRight, right, Turning{Side::kRight, false}, settings).advice, "reverse_right: false");
  EXPECT_EQ(judge_turning(Side::kRight, right, Turning{Side::kRight, true}, settings).advice, "");
}

}  // namespace
}  // namespace twocone::doctor
