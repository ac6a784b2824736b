// SPDX-License-Identifier: Apache-2.0
#include "drivers/memory/memory.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace twocone::memory {
namespace {

using namespace std::chrono_literals;

constexpr auto kTimeout = 200ms;

class MemoryDiffDriveTest : public testing::Test {
 protected:
  std::shared_ptr<ManualClock> clock_ = std::make_shared<ManualClock>();
  std::unique_ptr<MemoryDiffDrive> drive_ = std::make_unique<MemoryDiffDrive>(clock_, DriveLimits{10, kTimeout});
  std::shared_ptr<const Wheels> wheels_ = drive_->wheels();
};

TEST_F(MemoryDiffDriveTest, NeedsAClockAndATime) {
  EXPECT_THROW(MemoryDiffDrive(nullptr, DriveLimits{}), std::invalid_argument);
  EXPECT_THROW(MemoryDiffDrive(clock_, DriveLimits{10, 0ns}), std::invalid_argument);
  EXPECT_THROW(Wheels(nullptr, 1s), std::invalid_argument);
}

// Catches a dead-man time that is only approximate: the wheels turn until a nanosecond before it, and are then stopped.
TEST_F(MemoryDiffDriveTest, TheDeadManTimeIsExact) {
  ASSERT_TRUE(drive_->set_speeds({4, -3}));
  clock_->advance(kTimeout - 1ns);
  EXPECT_EQ(wheels_->speeds(), (WheelSpeeds{4, -3}));
  clock_->advance(1ns);
  EXPECT_EQ(wheels_->speeds(), WheelSpeeds{});
  const double left_rad = drive_->read_angles()->left_rad;
  EXPECT_DOUBLE_EQ(left_rad, 4 * 0.2);
  clock_->advance(1h);
  EXPECT_EQ(drive_->read_angles()->left_rad, left_rad);
  EXPECT_DOUBLE_EQ(drive_->read_angles()->right_rad, -3 * 0.2);
}

TEST_F(MemoryDiffDriveTest, AnglesAreTheIntegralOfTheSpeeds) {
  ASSERT_TRUE(drive_->set_speeds({1.5, 2.5}));
  clock_->advance(40ms);
  ASSERT_TRUE(drive_->set_speeds({-6, 0.5}));
  clock_->advance(30ms);
  ASSERT_TRUE(drive_->stop());
  clock_->advance(50ms);
  ASSERT_TRUE(drive_->set_speeds({2, 2}));
  clock_->advance(1s);  // the dead-man rule stops the wheels after 200 ms of it
  const auto angles = drive_->read_angles();
  ASSERT_TRUE(angles);
  EXPECT_DOUBLE_EQ(angles->left_rad, 1.5 * 0.04 - 6 * 0.03 + 2 * 0.2);
  EXPECT_DOUBLE_EQ(angles->right_rad, 2.5 * 0.04 + 0.5 * 0.03 + 2 * 0.2);
  EXPECT_EQ(angles->time, clock_->now());
}

TEST_F(MemoryDiffDriveTest, RecordsItsCommands) {
  ASSERT_TRUE(drive_->set_speeds({1, 2}));
  clock_->advance(30ms);
  ASSERT_TRUE(drive_->set_speeds({40, 20}));
  ASSERT_TRUE(drive_->stop());
  drive_.reset();
  const auto& commands = wheels_->commands();
  ASSERT_EQ(commands.size(), 4U);
  EXPECT_EQ(commands[0].speeds, (WheelSpeeds{1, 2}));
  EXPECT_EQ(commands[0].time.since_zero, 0ns);
  EXPECT_EQ(commands[1].speeds, (WheelSpeeds{10, 5})) << "as applied";
  EXPECT_EQ(commands[1].time.since_zero, 30ms);
  EXPECT_EQ(commands[2].speeds, WheelSpeeds{}) << "stop()";
  EXPECT_EQ(commands[3].speeds, WheelSpeeds{}) << "the destructor";
}

}  // namespace
}  // namespace twocone::memory
