// SPDX-License-Identifier: Apache-2.0
#include "tests/support/faulty_diffdrive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/memory/memory.h"
#include "tests/support/error_of.h"
#include "tests/support/fails_with.h"

namespace twocone::testing_support {
namespace {

using namespace std::chrono_literals;
using memory::MemoryDiffDrive;
using memory::Wheels;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::uint64_t kDriveSeed = 20062;
constexpr auto kTimeout = 200ms;

class FaultyDiffDriveTest : public testing::Test {
 protected:
  void open(const DriveFaults& faults, std::uint64_t seed = kDriveSeed) {
    clock_ = std::make_shared<ManualClock>();
    auto drive = std::make_unique<MemoryDiffDrive>(clock_, DriveLimits{10, kTimeout});
    wheels_ = drive->wheels();
    drive_ = std::make_unique<FaultyDiffDrive>(std::move(drive), faults, seed);
  }

  std::shared_ptr<ManualClock> clock_;
  std::shared_ptr<const Wheels> wheels_;
  std::unique_ptr<DiffDrive> drive_;
};

TEST_F(FaultyDiffDriveTest, EveryBadFieldIsNamed) {
  DriveFaults faults;
  faults.command_lost_chance = 2;
  faults.misread_chance = std::numeric_limits<double>::quiet_NaN();
  faults.misread_rad = -1;
  EXPECT_THAT(error_of<std::invalid_argument>([&] { check(faults); }),
              AllOf(HasSubstr("command_lost_chance is 2"), HasSubstr("misread_chance is nan"),
                    HasSubstr("misread_rad is -1 rad")));
  EXPECT_THROW(open(faults), std::invalid_argument);
  EXPECT_THROW(FaultyDiffDrive(nullptr, {}, kDriveSeed), std::invalid_argument);
}

TEST_F(FaultyDiffDriveTest, HasTheLimitsOfTheDriveBehindIt) {
  open({});
  EXPECT_EQ(drive_->limits().max_speed_radps, 10);
  EXPECT_EQ(drive_->limits().command_timeout, kTimeout);
}

TEST_F(FaultyDiffDriveTest, ALostCommandNeverReachesTheWheels) {
  DriveFaults faults;
  faults.command_lost_chance = 1;
  open(faults);
  EXPECT_THAT(drive_->set_speeds({1, 1}), FailsWith(ErrorCode::kTimeout));
  EXPECT_EQ(drive_->stop().error().code, ErrorCode::kTimeout);
  EXPECT_TRUE(wheels_->commands().empty());
}

// The more dangerous case of a command without reply: the command was carried out.
TEST_F(FaultyDiffDriveTest, ALostReplyDoesNotStopTheCommand) {
  DriveFaults faults;
  faults.reply_lost_chance = 1;
  open(faults);
  EXPECT_THAT(drive_->set_speeds({1, 2}), FailsWith(ErrorCode::kTimeout));
  EXPECT_EQ(wheels_->speeds(), (WheelSpeeds{1, 2}));
  EXPECT_EQ(drive_->stop().error().code, ErrorCode::kTimeout);
  EXPECT_EQ(wheels_->speeds(), WheelSpeeds{});
}

TEST_F(FaultyDiffDriveTest, ReadingsFailInTheirTwoWays) {
  DriveFaults faults;
  faults.read_timeout_chance = 1;
  open(faults);
  EXPECT_EQ(drive_->read_angles().error().code, ErrorCode::kTimeout);
  faults = {};
  faults.bad_data_chance = 1;
  open(faults);
  EXPECT_EQ(drive_->read_angles().error().code, ErrorCode::kBadData);
  EXPECT_TRUE(drive_->set_speeds({1, 1})) << "commands still get through";
}

TEST_F(FaultyDiffDriveTest, AMisreadAngleIsWithinItsBound) {
  DriveFaults faults;
  faults.misread_chance = 0.5;
  faults.misread_rad = 0.25;
  open(faults);
  int wrong = 0;
  double largest_rad = 0;
  constexpr int kReadings = 200;
  for (int i = 0; i < kReadings; ++i) {
    const auto angles = drive_->read_angles();
    ASSERT_TRUE(angles);
    wrong += angles->left_rad != 0 ? 1 : 0;
    largest_rad = std::max({largest_rad, std::abs(angles->left_rad), std::abs(angles->right_rad)});
  }
  EXPECT_GT(wrong, 0);
  EXPECT_LT(wrong, kReadings);
  EXPECT_LE(largest_rad, 0.25);
  EXPECT_GT(largest_rad, 0.2) << "among this many readings, some come near the bound";
}

// The case for which the dead-man rule exists: the program still commands, but no command arrives.
TEST_F(FaultyDiffDriveTest, WhenTheCableComesOffTheWheelsStopByThemselves) {
  DriveFaults faults;
  faults.disconnect_after = 3;
  open(faults);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(drive_->set_speeds({5, 5})) << "call " << i;
    clock_->advance(50ms);
  }
  const auto cut = wheels_->commands().size();
  for (int i = 0; i < 6; ++i) {
    EXPECT_THAT(drive_->set_speeds({5, 5}), FailsWith(ErrorCode::kDisconnected)) << "call " << i << " after";
    EXPECT_EQ(drive_->read_angles().error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(drive_->stop().error().code, ErrorCode::kDisconnected);
    clock_->advance(50ms);
  }
  EXPECT_EQ(wheels_->commands().size(), cut) << "no command reached the wheels";
  EXPECT_EQ(wheels_->speeds(), WheelSpeeds{});
  // The wheels turn during two commands of 50 ms and the dead-man time after the last one.
  EXPECT_DOUBLE_EQ(wheels_->angles().left_rad, 5 * (0.05 + 0.05 + 0.2));
}

TEST_F(FaultyDiffDriveTest, TheSeedRepeatsTheFaults) {
  DriveFaults faults;
  faults.command_lost_chance = faults.reply_lost_chance = faults.read_timeout_chance = faults.bad_data_chance = 0.2;
  faults.misread_chance = 0.3;
  const auto history = [&](std::uint64_t seed) {
    open(faults, seed);
    std::vector<double> results;
    for (int i = 0; i < 100; ++i) {
      results.push_back(drive_->set_speeds({1, 1}) ? 1 : 0);
      const auto angles = drive_->read_angles();
      results.push_back(angles ? angles->left_rad : -1000 - static_cast<int>(angles.error().code));
      clock_->advance(20ms);
    }
    return results;
  };
  EXPECT_EQ(history(5), history(5));
  EXPECT_NE(history(5), history(6));
}

}  // namespace
}  // namespace twocone::testing_support
