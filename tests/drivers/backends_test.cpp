// SPDX-License-Identifier: Apache-2.0
#include "drivers/backends.h"

#include <cmath>
#include <set>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::drivers {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

constexpr CameraSettings kSmall{64, 48, 20};
// For a picture of that size by POV-Ray, on a busy machine; only a test that fails waits so long.
constexpr auto kLong = 30s;

RobotSettings all_parts(const std::string& driver) {
  RobotSettings settings;
  settings.lower = settings.upper = {driver, kSmall, 1, {}};
  settings.drive = {driver, DriveLimits{10, 500ms}};
  settings.world = SimulatedWorld();
  settings.world->place.scene = TWOCONE_SOURCE_DIR "/tests/sim_povray/scenes/tiny.pov";
  return settings;
}

Error error_of(const RobotSettings& settings) {
  const auto robot = open_robot(settings);
  return robot ? Error{ErrorCode::kInvalidState, "it was opened"} : robot.error();
}

TEST(Backends, AreKnownByNameOnce) {
  std::set<std::string_view> names;
  for (const Backend& backend : backends()) {
    EXPECT_TRUE(names.insert(backend.name).second) << backend.name;
    EXPECT_TRUE(backend.for_cameras || backend.for_drive) << backend.name;
  }
  EXPECT_EQ(names, (std::set<std::string_view>{"memory", "sim_povray", "v4l2_camera", "libcamera_camera",
                                               "serial_diffdrive"}));
}

// Catches a row that says one thing and a function that does another: each row is tried for each part.
TEST(Backends, TheTableTellsWhatOpeningDoes) {
  for (const Backend& backend : backends()) {
    for (const bool is_drive : {false, true}) {
      SCOPED_TRACE(testing::Message() << backend.name << (is_drive ? " for the drive" : " for cameras"));
      RobotSettings settings = all_parts(std::string(backend.name));
      if (!backend.available()) {
        settings = all_parts("memory");
        (is_drive ? settings.drive.driver : settings.lower.driver) = backend.name;
      }
      const auto robot = open_robot(settings);
      const bool suits = is_drive ? backend.for_drive : backend.for_cameras;
      if (suits && backend.available()) {
        EXPECT_TRUE(robot) << robot.error().message;
      } else {
        ASSERT_FALSE(robot);
        EXPECT_EQ(robot.error().code, suits ? ErrorCode::kUnavailable : ErrorCode::kRefused) << robot.error().message;
      }
    }
  }
}

TEST(OpenRobot, AnUnknownDriverIsToldWhichThereAre) {
  RobotSettings settings = all_parts("memory");
  settings.upper.driver = "v4l";
  Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_EQ(error.message,
            "cameras.upper: there is no driver 'v4l'; drivers for it are: memory, sim_povray (and, not in this build: "
            "v4l2_camera, libcamera_camera)");
  settings = all_parts("memory");
  settings.drive.driver = "";
  error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_EQ(error.message,
            "drive: there is no driver ''; drivers for it are: memory, sim_povray (and, not in this build: "
            "serial_diffdrive)");
}

TEST(OpenRobot, ADriverThatIsNotInThisBuildSaysWhy) {
  RobotSettings settings = all_parts("memory");
  settings.lower.driver = "v4l2_camera";
  Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kUnavailable);
  EXPECT_EQ(error.message,
            "cameras.lower: driver 'v4l2_camera' is not in this build: twocone 0.1 has no V4L2 driver yet; drivers "
            "that are: memory, sim_povray");
  settings.lower.driver = "libcamera_camera";
  EXPECT_THAT(error_of(settings).message, HasSubstr("has no libcamera driver yet"));
  settings = all_parts("memory");
  settings.drive.driver = "serial_diffdrive";
  error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kUnavailable);
  EXPECT_THAT(error.message, AllOf(HasSubstr("drive: "), HasSubstr("motor controllers")));
}

TEST(OpenRobot, ADriverForAnotherKindOfPartIsRefused) {
  RobotSettings settings = all_parts("memory");
  settings.drive.driver = "v4l2_camera";
  Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message, "drive: driver 'v4l2_camera' is for cameras; drivers for it are: memory, sim_povray");
  settings = all_parts("memory");
  settings.upper.driver = "serial_diffdrive";
  error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message,
            "cameras.upper: driver 'serial_diffdrive' is for a drive; drivers for it are: memory, sim_povray");
}

TEST(OpenRobot, SimulatedAndOtherPartsDoNotMix) {
  for (const int simulated : {0b001, 0b010, 0b100, 0b011, 0b101, 0b110}) {
    RobotSettings settings = all_parts("memory");
    if (simulated & 1) settings.lower.driver = "sim_povray";
    if (simulated & 2) settings.upper.driver = "sim_povray";
    if (simulated & 4) settings.drive.driver = "sim_povray";
    const Error error = error_of(settings);
    EXPECT_EQ(error.code, ErrorCode::kRefused) << simulated;
    EXPECT_THAT(error.message, AllOf(HasSubstr("cameras.lower: " + settings.lower.driver),
                                     HasSubstr("cameras.upper: " + settings.upper.driver),
                                     HasSubstr("drive: " + settings.drive.driver),
                                     HasSubstr("sim_povray moves all parts of a robot or none: a simulated camera "
                                               "cannot see a real drive move")));
  }
}

TEST(OpenRobot, EveryBadSettingIsNamedByItsPart) {
  RobotSettings settings = all_parts("sim_povray");
  settings.lower.settings.width_px = 0;
  settings.upper.settings.rate_hz = 30;
  settings.upper.antialias = 10;
  settings.drive.limits.max_speed_radps = -1;
  settings.max_skew = -1ns;
  settings.world.reset();
  try {
    (void)open_robot(settings);
    FAIL() << "nothing was thrown";
  } catch (const std::invalid_argument& complaint) {
    EXPECT_THAT(complaint.what(),
                AllOf(HasSubstr("cameras.lower: CameraSettings: width_px is 0"),
                      HasSubstr("cameras.upper: ViewSettings: antialias is 10, must be 1 to 9"),
                      HasSubstr("rate_hz is 20 Hz for lower and 30 Hz for upper"),
                      HasSubstr("drive: DriveLimits: max_speed_radps is -1 rad/s"), HasSubstr("max_skew is -1 ns"),
                      HasSubstr("world: is missing, sim_povray needs one")));
  }
  settings = all_parts("memory");
  settings.world.reset();
  EXPECT_NO_THROW(check(settings)) << "only a simulation needs a world";
}

TEST(OpenRobot, WhatTheSceneLacksIsTold) {
  RobotSettings settings = all_parts("sim_povray");
  settings.world->place.scene = TWOCONE_SOURCE_DIR "/tests/drivers/no_such_scene.pov";
  const Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_THAT(error.message, HasSubstr("no_such_scene.pov"));
}

// Catches parts with clocks of their own: the pair would not be of one instant, or the wheels not move with the frames.
TEST(OpenRobot, AMemoryRobotRunsInLockStep) {
  auto robot = open_robot(all_parts("memory"));
  ASSERT_TRUE(robot) << robot.error().message;
  EXPECT_EQ(robot->true_pose(), std::nullopt);
  ASSERT_TRUE(robot->start(kSmall, kSmall));
  for (std::uint64_t i = 0; i < 100; ++i) {
    const auto frame = robot->next_frame(0ms);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->lower.header().sequence, i);
    EXPECT_EQ(frame->skew(), 0ns);
    const auto angles = robot->drive().read_angles();
    ASSERT_TRUE(angles);
    EXPECT_EQ(angles->time, frame->lower.header().captured);
    // 2 rad/s for i frames of 50 ms; the sum of 100 products, each about 10 rad at most, rounds by less than 1e-12.
    EXPECT_NEAR(angles->left_rad, 2 * 0.05 * static_cast<double>(i), 1e-12);
    ASSERT_TRUE(robot->drive().set_speeds({2, 2}));
  }
}

// Catches devices that die with the simulation they came from, a drive that moves another world than the cameras see,
// and limits that are not handed on.
TEST(OpenRobot, ASimulatedRobotDrivesAndSees) {
  RobotSettings settings = all_parts("sim_povray");
  settings.drive.limits = {8, 300ms};
  auto robot = open_robot(settings);
  ASSERT_TRUE(robot) << robot.error().message;
  EXPECT_EQ(robot->drive().limits().max_speed_radps, 8);
  EXPECT_EQ(robot->drive().limits().command_timeout, 300ms);
  const auto started = robot->start(kSmall, kSmall);
  ASSERT_TRUE(started) << started.error().message;
  const auto first = robot->next_frame(kLong);
  ASSERT_TRUE(first) << first.error().message;
  const auto at_first = robot->true_pose();
  ASSERT_TRUE(at_first.has_value());
  ASSERT_TRUE(robot->drive().set_speeds({4, 4}));
  const auto second = robot->next_frame(kLong);
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->skew(), 0ns);
  const auto lower = second->lower.image(kLong);
  const auto upper = second->upper.image(kLong);
  ASSERT_TRUE(lower) << lower.error().message;
  ASSERT_TRUE(upper) << upper.error().message;
  EXPECT_NE(**lower, **upper) << "two cameras, not one twice";
  const Pose2 moved = *robot->true_pose();
  const double way_m = std::hypot(moved.x_m - at_first->x_m, moved.y_m - at_first->y_m);
  // 4 rad/s, wheels of 0.05 m, 50 ms, without slip.
  EXPECT_NEAR(way_m, 4 * 0.05 * 0.05, 1e-12);
}

}  // namespace
}  // namespace twocone::drivers
