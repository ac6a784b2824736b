// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "tests/hal/scripted_devices.h"
#include "tests/support/error_of.h"

namespace twocone {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string complaint_of(const auto& call) { return testing_support::error_of<std::invalid_argument>(call); }

TEST(CameraSettings, GoodOnesPass) {
  EXPECT_NO_THROW(check(CameraSettings{}));
  EXPECT_NO_THROW(check(CameraSettings{1, 1, std::numeric_limits<double>::denorm_min()}));
}

TEST(CameraSettings, EveryBadFieldIsNamedWithItsValue) {
  EXPECT_THAT(complaint_of([] {
                check(CameraSettings{0, -3, -2.5});
              }),
              AllOf(HasSubstr("width_px is 0"), HasSubstr("height_px is -3"), HasSubstr("rate_hz is -2.5 Hz")));
  EXPECT_THAT(complaint_of([] {
                check(CameraSettings{640, 0, 15});
              }),
              AllOf(HasSubstr("height_px is 0"), Not(HasSubstr("width_px")), Not(HasSubstr("rate_hz"))));
}

TEST(CameraSettings, ARateIsPositiveAndFinite) {
  for (const double rate_hz : {0.0, -1.0, kNaN, kInfinity}) {
    EXPECT_THAT(complaint_of([&] { check(CameraSettings{640, 480, rate_hz}); }), HasSubstr("rate_hz")) << rate_hz;
  }
}

TEST(DriveLimits, EveryBadFieldIsNamedWithItsValue) {
  EXPECT_NO_THROW(check(DriveLimits{}));
  EXPECT_THAT(complaint_of([] {
                check(DriveLimits{-7.5, 0ns});
              }),
              AllOf(HasSubstr("max_speed_radps is -7.5 rad/s"), HasSubstr("command_timeout is 0 ns")));
  for (const double speed : {0.0, kNaN, kInfinity}) {
    EXPECT_THROW(check(DriveLimits{speed, 1s}), std::invalid_argument) << speed;
  }
  EXPECT_THROW(check(DriveLimits{1, -1ns}), std::invalid_argument);
}

TEST(DiffDrive, IsNotMadeWithBadLimits) {
  const auto script = std::make_shared<test::ScriptedDrive::Script>();
  const auto log = std::make_shared<test::Log>();
  EXPECT_THROW(test::ScriptedDrive(script, log, DriveLimits{kNaN, 1s}), std::invalid_argument);
}

class DiffDriveFrontTest : public testing::Test {
 protected:
  std::shared_ptr<test::ScriptedDrive::Script> script_ = std::make_shared<test::ScriptedDrive::Script>();
  std::shared_ptr<test::Log> log_ = std::make_shared<test::Log>();
  test::ScriptedDrive drive_{script_, log_, DriveLimits{8, 1s}};
};

TEST_F(DiffDriveFrontTest, PassesOnSpeedsWithinTheLimit) {
  const auto applied = drive_.set_speeds({8, -7.3});
  ASSERT_TRUE(applied);
  EXPECT_EQ(*applied, (WheelSpeeds{8, -7.3}));
  EXPECT_EQ(script_->speeds.back(), *applied);
}

// Catches a limit that clamps each wheel separately, which changes the curve that is driven.
TEST_F(DiffDriveFrontTest, ScalesBothWheelsByOneFactor) {
  const auto applied = drive_.set_speeds({-20, 5});
  ASSERT_TRUE(applied);
  EXPECT_EQ(*applied, (WheelSpeeds{-8, 2}));  // 8 * (5 / 20) is exact
  EXPECT_EQ(script_->speeds.back(), *applied);
}

// Catches a factor max / fastest that underflows, or a sum that overflows.
TEST_F(DiffDriveFrontTest, ScalesTheLargestNumbers) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  const auto applied = drive_.set_speeds({kLargest, -kLargest / 4});
  ASSERT_TRUE(applied);
  EXPECT_EQ(*applied, (WheelSpeeds{8, -2}));
}

TEST_F(DiffDriveFrontTest, RefusesSpeedsThatAreNotFiniteBeforeTheDeviceGetsThem) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_THROW((void)drive_.set_speeds({bad, 1}), std::invalid_argument) << bad;
    EXPECT_THROW((void)drive_.set_speeds({1, bad}), std::invalid_argument) << bad;
  }
  EXPECT_TRUE(log_->empty());
}

TEST_F(DiffDriveFrontTest, PassesOnTheDevicesErrors) {
  script_->answer = Error{ErrorCode::kDisconnected, "unplugged"};
  const auto set = drive_.set_speeds({1, 1});
  const auto read = drive_.read_angles();
  const auto stopped = drive_.stop();
  ASSERT_FALSE(set);
  ASSERT_FALSE(read);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(set.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(read.error().message, "unplugged");
  EXPECT_EQ(stopped.error().message, "unplugged");
}

class CameraFrontTest : public testing::Test {
 protected:
  std::shared_ptr<test::ScriptedCamera::Script> script_ = std::make_shared<test::ScriptedCamera::Script>();
  std::shared_ptr<test::Log> log_ = std::make_shared<test::Log>();
  test::ScriptedCamera camera_{"camera", script_, log_};
};

// Catches a public call that does not check state and arguments: a driver need not check again.
TEST_F(CameraFrontTest, AWrongCallNeverReachesTheDriver) {
  EXPECT_EQ(camera_.start().error().code, ErrorCode::kInvalidState);
  EXPECT_EQ(camera_.grab(0ms).error().code, ErrorCode::kInvalidState);
  camera_.stop();
  EXPECT_THROW((void)camera_.configure({0, 1, 1}), std::invalid_argument);
  EXPECT_THROW((void)camera_.grab(-1ms), std::invalid_argument);
  EXPECT_TRUE(log_->empty());
}

TEST_F(CameraFrontTest, AFailedStepLeavesTheStateAsItWas) {
  script_->configured = Error{ErrorCode::kDisconnected, "unplugged"};
  EXPECT_EQ(camera_.configure({}).error().message, "unplugged");
  EXPECT_EQ(camera_.state(), Camera::State::kClosed);
  script_->configured = {};
  ASSERT_TRUE(camera_.configure({}));
  script_->started = Error{ErrorCode::kUnavailable, "busy"};
  EXPECT_EQ(camera_.start().error().message, "busy");
  EXPECT_EQ(camera_.state(), Camera::State::kConfigured);
  script_->started = {};
  ASSERT_TRUE(camera_.start());
  EXPECT_FALSE(camera_.grab(0ms));
  EXPECT_EQ(camera_.state(), Camera::State::kStreaming) << "a failed grab does not end the stream";
}

}  // namespace
}  // namespace twocone
