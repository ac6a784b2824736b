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
};

struct DriveCase {
  std::string name;  ///< of letters and digits
  /// The shortest time that `pass` can let pass; the dead-man time of every drive opened is kTimeoutSteps of them.
  std::chrono::nanoseconds step{0};
  std::function<OpenedDrive(const DriveLimits&)> open;
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

  /// A stretch of time in which the wheels turned at one speed.
  struct Stretch {
    WheelSpeeds applied;
    WheelAngles from, to;
  };
  /// Commands once, does what is to be done `meanwhile`, and lets `steps` pass, fewer than kTimeoutSteps. Where the
  /// machine was so slow that the dead-man rule may have struck, the stretch is driven again.
  Stretch drive_for(
      int steps, const WheelSpeeds& wanted, const std::function<void()>& meanwhile = [] {});

  static void expect_turned(const Stretch& stretch, const WheelSpeeds& speeds);
  /// The wheels do not turn while time passes.
  void expect_standing();

  OpenedDrive opened_;
};

}  // namespace twocone::test
