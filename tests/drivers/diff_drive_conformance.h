// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "hal/diff_drive.h"

/// The behaviour that every DiffDrive must have, whatever its backend. To test a new backend, write a DriveCase and
/// instantiate the suite, as memory_conformance_test.cpp does; diff_drive_conformance_test.cpp holds the tests.
namespace twocone::test {

struct OpenedDrive {
  std::unique_ptr<DiffDrive> drive;
  /// Lets this time pass on the drive's clock; a whole number of DriveCase::step.
  std::function<void(std::chrono::nanoseconds)> pass;
  /// The distance that the wheels have moved, in any unit, measured from outside, also after the drive is destroyed.
  std::function<double()> way;
  /// Waits until the last command has taken effect; absent: it takes effect at once.
  std::function<void()> settle{};
};

struct DriveCase {
  std::string name;  ///< only letters and digits
  /// The shortest time that `pass` can let pass; the dead-man time of every opened drive is kTimeoutSteps of them.
  std::chrono::nanoseconds step{0};
  std::function<OpenedDrive(const DriveLimits&)> open;
  /// For a drive in real time whose device is not this program: the largest difference between the time of a command or
  /// reading and the time at which it takes effect or is measured. A longer delay is attributed to the machine, and the
  /// test tries again. 0: exact.
  std::chrono::nanoseconds jitter{0};
  double resolution_rad = 0;  ///< of the angles, and of a speed held for one step
};

inline void PrintTo(const DriveCase& drive_case, std::ostream* os) { *os << drive_case.name; }

inline std::string drive_case_name(const testing::TestParamInfo<DriveCase>& tested) { return tested.param.name; }

class DiffDriveConformance : public testing::TestWithParam<DriveCase> {
 protected:
  static constexpr int kTimeoutSteps = 3;
  static constexpr double kMaxSpeed_radps = 10;
  /// The number of tries for a stretch that the machine disturbed.
  static constexpr int kTries = 20;

  void SetUp() override { opened_ = GetParam().open({kMaxSpeed_radps, kTimeoutSteps * step()}); }

  [[nodiscard]] std::chrono::nanoseconds step() const { return GetParam().step; }
  void pass(int steps) { opened_.pass(steps * step()); }
  DiffDrive& drive() { return *opened_.drive; }
  WheelSpeeds set(const WheelSpeeds& wanted);
  WheelAngles read();
  /// Returns whether a call has taken longer than the drive's jitter since the last call of this function.
  bool was_slow();

  /// An interval in which the wheels turned at one speed.
  struct Stretch {
    WheelSpeeds applied;
    WheelAngles from, to;
  };
  /// Commands once, calls `meanwhile`, and lets `steps` pass, fewer than kTimeoutSteps. If the machine was so slow that
  /// the dead-man rule may have stopped the wheels, the stretch is driven again.
  Stretch drive_for(
      int steps, const WheelSpeeds& wanted, const std::function<void()>& meanwhile = [] {});

  [[nodiscard]] static double tolerance_rad(double speed_radps);
  static void expect_turned(const Stretch& stretch, const WheelSpeeds& speeds);
  /// Expects that the wheels do not turn while time passes.
  void expect_standing();
  /// Waits in real time until the wheels are stopped, because the dead-man rule may act a little late.
  void wait_for_stop();
  /// Commands once, waits until the dead-man rule has stopped the wheels, and returns their motion.
  Stretch run_out(const WheelSpeeds& speeds);

  OpenedDrive opened_;

 private:
  void settle() const;

  std::chrono::nanoseconds longest_call_{0};
};

}  // namespace twocone::test
