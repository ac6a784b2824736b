// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "hal/diff_drive.h"

/// What every DiffDrive must do, whatever stands behind it. To put a new backend through it, write down a DriveCase and
/// instantiate the suite, as memory_conformance_test.cpp does; diff_drive_conformance_test.cpp holds the tests.
namespace twocone::test {

struct OpenedDrive {
  std::unique_ptr<DiffDrive> drive;
  /// Lets so much time pass on the drive's clock; a whole number of DriveCase::step.
  std::function<void(std::chrono::nanoseconds)> pass;
  /// How far the wheels have gone in any measure, seen from outside: also after the drive is destroyed.
  std::function<double()> way;
  /// Sees to it that what was commanded is in force; absent: it is.
  std::function<void()> settle{};
};

struct DriveCase {
  std::string name;  ///< of letters and digits
  /// The shortest time that `pass` can let pass; the dead-man time of every drive opened is kTimeoutSteps of them.
  std::chrono::nanoseconds step{0};
  std::function<OpenedDrive(const DriveLimits&)> open;
  /// Of a drive in real time whose device is not this program: so much earlier or later than their times, speeds are in
  /// force and readings told. What takes longer is put down to the machine and tried again. 0: exact.
  std::chrono::nanoseconds jitter{0};
  double resolution_rad = 0;  ///< of the angles, and of a speed kept for a step
};

inline void PrintTo(const DriveCase& drive_case, std::ostream* os) { *os << drive_case.name; }

inline std::string drive_case_name(const testing::TestParamInfo<DriveCase>& tested) { return tested.param.name; }

class DiffDriveConformance : public testing::TestWithParam<DriveCase> {
 protected:
  static constexpr int kTimeoutSteps = 3;
  static constexpr double kMaxSpeed_radps = 10;
  /// How often a stretch that the machine spoilt is tried again.
  static constexpr int kTries = 20;

  void SetUp() override { opened_ = GetParam().open({kMaxSpeed_radps, kTimeoutSteps * step()}); }

  [[nodiscard]] std::chrono::nanoseconds step() const { return GetParam().step; }
  void pass(int steps) { opened_.pass(steps * step()); }
  DiffDrive& drive() { return *opened_.drive; }
  WheelSpeeds set(const WheelSpeeds& wanted);
  WheelAngles read();
  /// Whether a call has taken longer than the drive's jitter since the last time that this was asked.
  bool was_slow();

  /// A stretch of time in which the wheels turned at one speed.
  struct Stretch {
    WheelSpeeds applied;
    WheelAngles from, to;
  };
  /// Commands once, does what is to be done `meanwhile`, and lets `steps` pass, fewer than kTimeoutSteps. Where the
  /// machine was so slow that the dead-man rule may have struck, the stretch is driven again.
  Stretch drive_for(
      int steps, const WheelSpeeds& wanted, const std::function<void()>& meanwhile = [] {});

  [[nodiscard]] static double tolerance_rad(double speed_radps);
  static void expect_turned(const Stretch& stretch, const WheelSpeeds& speeds);
  /// The wheels do not turn while time passes.
  void expect_standing();
  /// Where real time passes, the dead-man rule may strike a little late.
  void wait_for_rest();
  /// Lets the dead-man rule strike, and tells what turned.
  Stretch run_out(const WheelSpeeds& speeds);

  OpenedDrive opened_;

 private:
  void settle() const;

  std::chrono::nanoseconds longest_call_{0};
};

}  // namespace twocone::test
