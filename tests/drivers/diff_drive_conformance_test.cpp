// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/diff_drive_conformance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <thread>
#include <utility>

namespace twocone::test {
namespace {

// Each change of speed has an error of up to a nanosecond, at up to 10 rad/s and at most 20 times per test: 2e-7 rad.
// The doubles that hold the angles, below 100 rad, round by 1e-14.
constexpr double kTolerance_rad = 2e-7;

double seconds(std::chrono::nanoseconds time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

double DiffDriveConformance::tolerance_rad(double speed_radps) {
  const DriveCase& tested = GetParam();
  return kTolerance_rad + 2 * std::abs(speed_radps) * seconds(tested.jitter) + 2 * tested.resolution_rad;
}

void DiffDriveConformance::expect_turned(const Stretch& stretch, const WheelSpeeds& speeds) {
  const double time_s = seconds(stretch.to.time - stretch.from.time);
  EXPECT_NEAR(stretch.to.left_rad - stretch.from.left_rad, speeds.left_radps * time_s,
              tolerance_rad(speeds.left_radps));
  EXPECT_NEAR(stretch.to.right_rad - stretch.from.right_rad, speeds.right_radps * time_s,
              tolerance_rad(speeds.right_radps));
}

void DiffDriveConformance::settle() const {
  if (opened_.settle) opened_.settle();
}

WheelSpeeds DiffDriveConformance::set(const WheelSpeeds& wanted) {
  const auto begun = std::chrono::steady_clock::now();
  const auto applied = drive().set_speeds(wanted);
  settle();
  longest_call_ = std::max<std::chrono::nanoseconds>(longest_call_, std::chrono::steady_clock::now() - begun);
  if (!applied) {
    ADD_FAILURE() << applied.error().message;
    return {};
  }
  return *applied;
}

WheelAngles DiffDriveConformance::read() {
  settle();
  const auto begun = std::chrono::steady_clock::now();
  const auto angles = drive().read_angles();
  longest_call_ = std::max<std::chrono::nanoseconds>(longest_call_, std::chrono::steady_clock::now() - begun);
  if (!angles) {
    ADD_FAILURE() << angles.error().message;
    return {};
  }
  return *angles;
}

bool DiffDriveConformance::was_slow() {
  const auto longest = std::exchange(longest_call_, std::chrono::nanoseconds(0));
  return GetParam().jitter.count() > 0 && longest > GetParam().jitter;
}

DiffDriveConformance::Stretch DiffDriveConformance::drive_for(int steps, const WheelSpeeds& wanted,
                                                              const std::function<void()>& meanwhile) {
  for (int i = 0; i < kTries; ++i) {
    (void)was_slow();
    const Timestamp before = read().time;
    Stretch stretch;
    stretch.applied = set(wanted);
    stretch.from = read();
    meanwhile();
    pass(steps);
    stretch.to = read();
    if (stretch.to.time - before < drive().limits().command_timeout && !was_slow()) return stretch;
  }
  ADD_FAILURE() << "in " << kTries << " tries, " << steps
                << " steps always took as long as the dead-man time, or a call longer than the drive's jitter";
  return {};
}

void DiffDriveConformance::expect_standing() {
  std::this_thread::sleep_for(GetParam().jitter);
  const WheelAngles before = read();
  const double way_before = opened_.way();
  pass(2);
  const WheelAngles after = read();
  EXPECT_GT(after.time - before.time, std::chrono::nanoseconds(0)) << "time has passed";
  EXPECT_EQ(after.left_rad, before.left_rad);
  EXPECT_EQ(after.right_rad, before.right_rad);
  EXPECT_EQ(opened_.way(), way_before);
}

void DiffDriveConformance::wait_for_stop() {
  if (GetParam().jitter.count() == 0) return;
  double way = opened_.way();
  for (int i = 0; i < kTries; ++i) {
    std::this_thread::sleep_for(step());
    const double now = opened_.way();
    if (now == way) return;
    way = now;
  }
}

DiffDriveConformance::Stretch DiffDriveConformance::run_out(const WheelSpeeds& speeds) {
  Stretch stretch;
  stretch.from = read();
  stretch.applied = set(speeds);
  pass(1);
  (void)read();
  pass(kTimeoutSteps);
  wait_for_stop();
  stretch.to = read();
  return stretch;
}

// Catches a drive that moves before the first command.
TEST_P(DiffDriveConformance, DoesNotMoveAtFirst) {
  const WheelAngles opened = read();
  EXPECT_EQ(opened.left_rad, 0);
  EXPECT_EQ(opened.right_rad, 0);
  expect_standing();
}

// Catches swapped wheels, a wrong sign, degrees, a wrong gear ratio, and angles with a wrong timestamp.
TEST_P(DiffDriveConformance, TurnsEachWheelAtItsSpeed) {
  constexpr WheelSpeeds kSpeeds{3.1, -1.7};
  for (const int steps : {1, 2}) {
    const Stretch stretch = drive_for(steps, kSpeeds);
    EXPECT_EQ(stretch.applied, kSpeeds);
    EXPECT_GT(stretch.to.time - stretch.from.time, std::chrono::nanoseconds(0));
    expect_turned(stretch, kSpeeds);
  }
}

// Catches a drive without a dead-man rule, one that keeps the rule only when it is called, one that counts from the
// reading instead of the command, and one with another time. The total angle is exact whenever the command came.
TEST_P(DiffDriveConformance, StopsByItselfWhenNoCommandComes) {
  constexpr WheelSpeeds kSpeeds{4.3, 6.1};
  const double timeout_s = seconds(drive().limits().command_timeout);
  const auto left_off = [&](const Stretch& s) {
    return s.to.left_rad - s.from.left_rad - kSpeeds.left_radps * timeout_s;
  };
  const auto right_off = [&](const Stretch& s) {
    return s.to.right_rad - s.from.right_rad - kSpeeds.right_radps * timeout_s;
  };
  Stretch stretch = run_out(kSpeeds);
  // In real time, the machine may delay the watchdog, so the test tries again.
  for (int i = 1; i < kTries && GetParam().jitter.count() > 0; ++i) {
    if (std::abs(left_off(stretch)) <= tolerance_rad(kSpeeds.left_radps) &&
        std::abs(right_off(stretch)) <= tolerance_rad(kSpeeds.right_radps)) {
      break;
    }
    stretch = run_out(kSpeeds);
  }
  EXPECT_NEAR(left_off(stretch), 0, tolerance_rad(kSpeeds.left_radps));
  EXPECT_NEAR(right_off(stretch), 0, tolerance_rad(kSpeeds.right_radps));
  expect_standing();
}

// Catches a dead-man time that runs from the first command, and one after which no new command works.
TEST_P(DiffDriveConformance, CommandsKeepItMoving) {
  constexpr WheelSpeeds kSpeeds{-2.9, -2.3};
  constexpr int kRounds = 2 * kTimeoutSteps;
  Timestamp before_command = read().time;
  set(kSpeeds);
  WheelAngles last = read();
  int rounds = 0;
  for (int i = 0; i < kRounds + kTries && rounds < kRounds; ++i) {
    pass(1);
    const Timestamp before_next = read().time;
    set(kSpeeds);
    const WheelAngles now = read();
    const bool was_slow_now = was_slow();
    // Otherwise the machine was too slow.
    if (now.time - before_command < drive().limits().command_timeout && !was_slow_now) {
      expect_turned({kSpeeds, last, now}, kSpeeds);
      ++rounds;
    }
    before_command = before_next;
    last = now;
  }
  EXPECT_EQ(rounds, kRounds) << "the machine was too slow too often";

  pass(kTimeoutSteps + 1);
  wait_for_stop();
  expect_standing();
  set(kSpeeds);
  const WheelAngles again = read();
  pass(1);
  EXPECT_LT(read().left_rad, again.left_rad) << "a new command moves it again";
}

// Catches a stop that only lets the wheels coast, or that leaves the work to the dead-man rule.
TEST_P(DiffDriveConformance, StopStopsAtOnce) {
  set({7.7, 7.7});
  pass(1);
  ASSERT_TRUE(drive().stop());
  expect_standing();
  ASSERT_TRUE(drive().stop()) << "twice is fine";
  expect_standing();
  set({-1, 2});
  const WheelAngles before = read();
  pass(1);
  EXPECT_GT(read().right_rad, before.right_rad) << "it moves again";
}

TEST_P(DiffDriveConformance, SpeedZeroStops) {
  set({5, -5});
  pass(1);
  set({0, 0});
  expect_standing();
}

// Catches a backend whose destructor leaves the stop to the base class: the wheels would turn until the dead-man time.
TEST_P(DiffDriveConformance, StopsWhenDestroyed) {
  const double way_at_first = opened_.way();
  set({6, 6});
  pass(1);
  opened_.drive.reset();
  const double way = opened_.way();
  EXPECT_NE(way, way_at_first) << "it did drive before";
  pass(1);
  EXPECT_EQ(opened_.way(), way);
}

// Catches a limit that is applied to each wheel separately (another curve), or that is reported but not kept.
TEST_P(DiffDriveConformance, ALimitedCommandKeepsItsCurve) {
  const Stretch stretch = drive_for(1, {25, -7});
  EXPECT_DOUBLE_EQ(stretch.applied.left_radps, kMaxSpeed_radps);
  EXPECT_DOUBLE_EQ(stretch.applied.right_radps, kMaxSpeed_radps * (-7.0 / 25.0));
  expect_turned(stretch, stretch.applied);
}

// Catches a NaN that reaches the wheels, and a refusal that changes their motion.
TEST_P(DiffDriveConformance, RefusesSpeedsThatAreNotFinite) {
  constexpr WheelSpeeds kSpeeds{2, 3};
  const Stretch stretch = drive_for(1, kSpeeds, [this] {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      EXPECT_THROW((void)drive().set_speeds({bad, 0}), std::invalid_argument) << bad;
      EXPECT_THROW((void)drive().set_speeds({0, -bad}), std::invalid_argument) << bad;
    }
  });
  expect_turned(stretch, kSpeeds);
}

// Catches encoder counts that wrap, and angles reduced to (-pi, pi]: the distance would jump back.
TEST_P(DiffDriveConformance, AnglesDoNotWrap) {
  const WheelAngles first = read();
  const int steps = 1 + static_cast<int>(2.2 * std::numbers::pi / (kMaxSpeed_radps * seconds(step())));
  WheelAngles last = first;
  for (int i = 0; i < steps; ++i) {
    set({kMaxSpeed_radps, -kMaxSpeed_radps});
    pass(1);
    const WheelAngles now = read();
    EXPECT_GT(now.left_rad, last.left_rad);
    EXPECT_LT(now.right_rad, last.right_rad);
    last = now;
  }
  EXPECT_GT(last.left_rad - first.left_rad, 2 * std::numbers::pi);
  EXPECT_LT(last.right_rad - first.right_rad, -2 * std::numbers::pi);
}

// Catches a reading that is stamped when its bytes are parsed, out of order, or by a different clock.
TEST_P(DiffDriveConformance, ReadingsComeInOrder) {
  WheelAngles last = read();
  for (int i = 0; i < 6; ++i) {
    if (i % 2 == 0) set({1, 1});
    if (i % 3 == 0) pass(1);
    const WheelAngles now = read();
    EXPECT_EQ(now.time.clock, last.time.clock);
    EXPECT_GE(now.time - last.time, std::chrono::nanoseconds(i % 3 == 0 ? 1 : 0));
    last = now;
  }
}

TEST_P(DiffDriveConformance, ReportsItsLimits) {
  EXPECT_EQ(drive().limits().max_speed_radps, kMaxSpeed_radps);
  EXPECT_EQ(drive().limits().command_timeout, kTimeoutSteps * step());
}

}  // namespace twocone::test
