// SPDX-License-Identifier: Apache-2.0
#include "drivers/backends.h"

#include <cmath>
#include <set>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_of.h"
#include "tests/support/fails_with.h"

namespace twocone::drivers {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr CameraSettings kSmall{64, 48, 20};
// The limit for a POV-Ray image of that size on a busy machine. Only a test that fails waits this long.
constexpr auto kLong = 30s;

/// Settings with devices that no machine has.
RobotSettings all_parts(const std::string& driver) {
  RobotSettings settings;
  settings.lower = settings.upper = {driver, kSmall, 1, {}, {.name = "/dev/no-such-camera", .format = ""}};
  settings.drive = {driver, DriveLimits{10, 500ms}};
  settings.drive.serial.emplace();
  settings.drive.serial->port = "/dev/no-such-port";
  settings.drive.serial->protocol = "create2";
  settings.world = SimulatedWorld();
  settings.world->place.scene = TWOCONE_SOURCE_DIR "/tests/sim_povray/scenes/tiny.pov";
  return settings;
}

bool is_of_devices(std::string_view driver) { return driver != "memory" && driver != "sim_povray"; }

/// The drivers as messages name them: "memory, sim_povray".
std::string drivers_of(bool for_drive, bool available = true) {
  std::string names;
  for (const Backend& backend : backends()) {
    if (backend.available() != available || !(for_drive ? backend.for_drive : backend.for_cameras)) continue;
    names += (names.empty() ? "" : ", ") + std::string(backend.name);
  }
  return names;
}
std::string not_built(bool for_drive) {
  const std::string names = drivers_of(for_drive, false);
  return names.empty() ? "" : " (not in this build: " + names + ")";
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

// Catches a row of the table that does not match its function: each row is tried for each part.
TEST(Backends, TheTableMatchesTheFunctions) {
  for (const Backend& backend : backends()) {
    for (const bool is_drive : {false, true}) {
      SCOPED_TRACE(testing::Message() << backend.name << (is_drive ? " for the drive" : " for cameras"));
      RobotSettings settings = all_parts(is_of_devices(backend.name) ? "memory" : std::string(backend.name));
      (is_drive ? settings.drive.driver : settings.lower.driver) = backend.name;
      const auto robot = open_robot(settings);
      const bool suits = is_drive ? backend.for_drive : backend.for_cameras;
      if (suits && !is_of_devices(backend.name)) {
        EXPECT_TRUE(robot) << robot.error().message;
        continue;
      }
      ASSERT_FALSE(robot);
      const ErrorCode unopened = backend.available() ? ErrorCode::kNotFound : ErrorCode::kUnavailable;
      EXPECT_EQ(robot.error().code, suits ? unopened : ErrorCode::kRefused) << robot.error().message;
      const std::string why_not(suits ? backend.why_not : "");
      EXPECT_THAT(robot.error().message, HasSubstr(why_not));
    }
  }
}

// Catches a part that is opened differently alone than in its robot.
TEST(Backends, APartOpensAlone) {
  const RobotSettings memory = all_parts("memory");
  EXPECT_TRUE(open_camera("cameras.lower", memory.lower));
  EXPECT_TRUE(open_drive(memory.drive));
  const RobotSettings simulated = all_parts("sim_povray");
  EXPECT_THAT(open_camera("cameras.upper", simulated.upper),
              FailsWith(ErrorCode::kRefused, HasSubstr("cameras.upper: a part of a simulated robot")));
  EXPECT_THAT(open_drive(simulated.drive), FailsWith(ErrorCode::kRefused));
  CameraPart nameless = memory.lower;
  nameless.driver = "v4l2_camera";
  nameless.device.name.clear();
  EXPECT_THROW((void)open_camera("cameras.lower", nameless), std::invalid_argument);
  DrivePart without = memory.drive;
  without.driver = "serial_diffdrive";
  without.serial.reset();
  EXPECT_THROW((void)open_drive(without), std::invalid_argument);
}

TEST(OpenRobot, TheErrorForAnUnknownDriverListsTheKnownOnes) {
  RobotSettings settings = all_parts("memory");
  settings.upper.driver = "v4l";
  Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_EQ(error.message,
            "cameras.upper: there is no driver 'v4l'; drivers for it are: " + drivers_of(false) + not_built(false));
  settings = all_parts("memory");
  settings.drive.driver = "";
  error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_EQ(error.message, "drive: there is no driver ''; drivers for it are: " + drivers_of(true) + not_built(true));
}

// The message is one line: the missing library, its package, and the available drivers. In a build that has every
// driver, this test checks nothing: tests/evidence/without.sh makes the builds that lack them.
TEST(OpenRobot, TheErrorForADriverThatIsNotInThisBuildHasTheReason) {
  for (const Backend& backend : backends()) {
    if (backend.available()) continue;
    SCOPED_TRACE(backend.name);
    RobotSettings settings = all_parts("memory");
    (backend.for_drive ? settings.drive.driver : settings.lower.driver) = backend.name;
    const Error error = error_of(settings);
    EXPECT_EQ(error.code, ErrorCode::kUnavailable);
    EXPECT_EQ(error.message, (backend.for_drive ? "drive: driver '" : "cameras.lower: driver '") +
                                 std::string(backend.name) + "' is not in this build: " + std::string(backend.why_not) +
                                 "; drivers that are: " + drivers_of(backend.for_drive));
    EXPECT_THAT(std::string(backend.why_not), AllOf(HasSubstr("built without"), HasSubstr("Debian: ")));
    EXPECT_EQ(error.message.find('\n'), std::string::npos);
  }
}

TEST(OpenRobot, ADriverForAnotherKindOfPartIsRefused) {
  RobotSettings settings = all_parts("memory");
  settings.drive.driver = "v4l2_camera";
  Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message, "drive: driver 'v4l2_camera' is for cameras; drivers for it are: " + drivers_of(true));
  settings = all_parts("memory");
  settings.upper.driver = "serial_diffdrive";
  error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kRefused);
  EXPECT_EQ(error.message,
            "cameras.upper: driver 'serial_diffdrive' is for a drive; drivers for it are: " + drivers_of(false));
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
  EXPECT_THAT(testing_support::error_of<std::invalid_argument>([&] { (void)open_robot(settings); }),
              AllOf(HasSubstr("cameras.lower: CameraSettings: width_px is 0"),
                    HasSubstr("cameras.upper: ViewSettings: antialias is 10, must be 1 to 9"),
                    HasSubstr("rate_hz is 20 Hz for lower and 30 Hz for upper"),
                    HasSubstr("drive: DriveLimits: max_speed_radps is -1 rad/s"), HasSubstr("max_skew is -1 ns"),
                    HasSubstr("world: is missing, sim_povray needs one")));
  settings = all_parts("memory");
  settings.world.reset();
  EXPECT_NO_THROW(check(settings)) << "only a simulation needs a world";
}

TEST(OpenRobot, AMissingSceneIsReported) {
  RobotSettings settings = all_parts("sim_povray");
  settings.world->place.scene = TWOCONE_SOURCE_DIR "/tests/drivers/no_such_scene.pov";
  const Error error = error_of(settings);
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_THAT(error.message, HasSubstr("no_such_scene.pov"));
}

// Catches parts with separate clocks: the pair would not show one moment, or the wheels would not move with the frames.
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

// Catches devices that fail after their Simulation object is destroyed, a drive that moves another world than the
// cameras show, and limits that are not passed on.
TEST(OpenRobot, ASimulatedRobotDrivesAndTakesImages) {
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
  EXPECT_NE(**lower, **upper) << "there must be two different cameras";
  const Pose2 moved = *robot->true_pose();
  const double way_m = std::hypot(moved.x_m - at_first->x_m, moved.y_m - at_first->y_m);
  // The wheels of 0.05 m radius turn at 4 rad/s for 50 ms without slip.
  EXPECT_NEAR(way_m, 4 * 0.05 * 0.05, 1e-12);
}

// Catches a robot file whose two entries are one camera. Without this check, the second open only reports "busy".
TEST(Backends, OneCameraForTwoEntriesIsRefusedByItsName) {
  for (const char* driver : {"v4l2_camera", "libcamera_camera"}) {
    RobotSettings settings = all_parts("memory");
    settings.lower.driver = settings.upper.driver = driver;
    EXPECT_THAT(
        check_cameras_differ(settings),
        FailsWith(ErrorCode::kRefused, AllOf(HasSubstr("cameras.lower ('/dev/no-such-camera') and cameras.upper"),
                                             HasSubstr("are one camera, /dev/no-such-camera"))))
        << driver;
    settings.upper.device.name = "/dev/no-other-camera";
    EXPECT_TRUE(check_cameras_differ(settings));
    settings.others.push_back({"rear", settings.lower});
    EXPECT_FALSE(check_cameras_differ(settings)) << "another camera of the robot";
  }
  EXPECT_TRUE(check_cameras_differ(all_parts("memory"))) << "cameras without devices";
}

}  // namespace
}  // namespace twocone::drivers
