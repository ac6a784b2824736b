// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/doctor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "tests/doctor/bench_devices.h"
#include "tests/support/temporary_folder.h"

namespace twocone::doctor {
namespace {

using testing::HasSubstr;
using testing_support::TemporaryFolder;

constexpr const char* kMap = R"(
bounds_m: {x: [-3, 3], y: [-2, 2]}
landmarks:
  - {name: red, colour: [1, 0, 0], x_m: -2.4, y_m: 0.3, radius_m: 0.1, top_m: 0.9}
)";

constexpr const char* kDevices = R"(
  lower: {driver: v4l2_camera, device: /dev/lower, width_px: 160, height_px: 120, rate_hz: 25}
  upper: {driver: v4l2_camera, device: /dev/upper, width_px: 160, height_px: 120, rate_hz: 25}
)";
constexpr const char* kMemory = R"(
  lower: {driver: memory, width_px: 160, height_px: 120, rate_hz: 25}
  upper: {driver: memory, width_px: 160, height_px: 120, rate_hz: 25}
)";
constexpr const char* kSerial = "serial_diffdrive, port: /dev/drive, protocol: roboclaw, counts_per_turn: 1000";

/// A robot of parts that the test provides, with the record of their use.
struct Bench : FakeSurroundings {
  TemporaryFolder folder;
  std::string cameras = kDevices;
  std::string drive = kSerial;
  CameraTruth lower_truth, upper_truth;
  DriveTruth drive_truth;
  std::optional<Error> no_upper, no_drive;
  Options options{.seconds = 1};
  std::shared_ptr<WheelLog> wheels = std::make_shared<WheelLog>();
  std::shared_ptr<int> streams = std::make_shared<int>(0);

  Bench() { static_cast<void>(folder.write("room.map.yaml", kMap)); }

  [[nodiscard]] config::Robot robot() const {
    return config::read_robot(folder.write("robot.yaml", fmt::format(R"(
name: mine
map: room.map.yaml
body: {{radius_m: 0.2}}
drive: {{driver: {}, wheel_separation_m: 0.3, wheel_radius_m: 0.05, max_speed_mps: 0.5, command_timeout_s: 0.5}}
cameras:
{}
rig:
  mirror: {{type: cone, apex_rad: 1.5707963267948966}}
  mirror_radius_m: 0.06
  lens_to_tip_m: 0.12
  mirror_separation_m: 0.30
  lens_height_m: 0.25
  sigma: 0
  lower: {{centre_px: [79.5, 59.5], rim_radius_px: 50, azimuth_rad: 0.0}}
  upper: {{centre_px: [79.5, 59.5], rim_radius_px: 50, azimuth_rad: 0.0}}
)",
                                                                     drive, cameras)));
  }

  Report examined() {
    Openers openers;
    openers.camera = [this](const std::string& part,
                            const drivers::CameraPart& wanted) -> Result<std::unique_ptr<Camera>> {
      const bool is_upper = wanted.device.name == "/dev/upper";
      if (is_upper && no_upper) return Error{no_upper->code, part + ": " + no_upper->message};
      return std::unique_ptr<Camera>(
          std::make_unique<BenchCamera>(clock, is_upper ? upper_truth : lower_truth, streams));
    };
    openers.drive = [this](const drivers::DrivePart&) -> Result<std::unique_ptr<DiffDrive>> {
      if (no_drive) return *no_drive;
      return std::unique_ptr<DiffDrive>(std::make_unique<BenchDrive>(clock, drive_truth, wheels));
    };
    Report report = examine(robot(), options, openers, surroundings());
    EXPECT_EQ(*streams, 0) << "streams on";
    EXPECT_FALSE(wheels->turn);
    return report;
  }
};

TEST(Doctor, ARobotInOrderIsOkExceptForWhatWasNotSeen) {
  Bench bench;
  bench.options.wheels_off_the_ground = true;
  const Report report = bench.examined();
  EXPECT_FALSE(report.has_failed()) << table(report);
  EXPECT_EQ(report.count(kWarning), 0U) << table(report);
  EXPECT_EQ(report.count(kNotRun), 2U) << table(report);
  EXPECT_EQ(row_of(report, "drive", "wheels seen").verdict, kNotRun);
  EXPECT_GT(bench.wheels->moves, 0);
  for (const char* part : {"files", "lower", "upper", "pair", "drive"}) {
    EXPECT_THAT(table(report), HasSubstr(std::string("\n") + part + " "));
  }
}

TEST(Doctor, WithoutAUserAndTheOptionNoWheelTurns) {
  Bench bench;
  const Report report = bench.examined();
  EXPECT_EQ(bench.wheels->moves, 0) << "commands";
  EXPECT_EQ(row_of(report, "drive", "moving tests").verdict, kNotRun);
  EXPECT_THAT(row_of(report, "drive", "moving tests").advice, HasSubstr("--wheels-off-the-ground"));
  EXPECT_FALSE(report.has_failed()) << table(report);
}

TEST(Doctor, TheAnswerNoTurnsNoWheel) {
  Bench bench;
  bench.person = [](const std::string&) { return "no"; };
  const Report report = bench.examined();
  EXPECT_EQ(bench.wheels->moves, 0) << "commands";
  ASSERT_EQ(bench.asked.size(), 1U);
  EXPECT_THAT(bench.asked[0], HasSubstr("off the ground"));
  EXPECT_EQ(row_of(report, "drive", "moving tests").verdict, kNotRun);
}

TEST(Doctor, TheAnswerYesTurnsTheWheels) {
  Bench bench;
  bench.person = [](const std::string& question) {
    return question.find("off the ground") != std::string::npos ? "yes" : "";
  };
  const Report report = bench.examined();
  EXPECT_GT(bench.wheels->moves, 0) << "commands";
  EXPECT_EQ(row_of(report, "drive", "stop, silence").verdict, kOk);
}

TEST(Doctor, WheelsThatCreepAreNotCommandedToTurn) {
  Bench bench;
  bench.options.wheels_off_the_ground = true;
  bench.drive_truth.creep_radps = 0.4;
  const Report report = bench.examined();
  EXPECT_EQ(bench.wheels->moves, 0) << "commands";
  EXPECT_TRUE(report.has_failed());
  EXPECT_EQ(row_of(report, "drive", "moving tests").verdict, kNotRun);
}

TEST(Doctor, WithAMissingCameraAllOtherPartsAreTested) {
  Bench bench;
  bench.no_upper = Error{ErrorCode::kNotFound, "/dev/upper: No such file or directory"};
  const Report report = bench.examined();
  const Row row = row_of(report, "upper", "opens");
  EXPECT_EQ(row.verdict, kFailed);
  EXPECT_EQ(row.measured, "/dev/upper: No such file or directory");
  EXPECT_THAT(row.advice, HasSubstr("plug it in"));
  EXPECT_EQ(row_of(report, "pair", "stream").verdict, kNotRun);
  EXPECT_EQ(row_of(report, "lower", "rate").verdict, kOk);
  EXPECT_EQ(row_of(report, "drive", "angles").verdict, kOk);
}

TEST(Doctor, OneCameraForTwoEntriesIsARowAndNoPair) {
  Bench bench;
  for (std::size_t at = bench.cameras.find("/dev/lower"); at != std::string::npos;
       at = bench.cameras.find("/dev/lower")) {
    bench.cameras.replace(at, 10, "/dev/upper");
  }
  const Report report = bench.examined();
  const Row row = row_of(report, "cameras", "two devices");
  EXPECT_EQ(row.verdict, kFailed);
  EXPECT_THAT(row.measured, HasSubstr("are one camera, /dev/upper"));
  EXPECT_THAT(row.advice, HasSubstr("each its own device:"));
  EXPECT_EQ(row_of(report, "pair", "stream").check, "no such row");
}

TEST(Doctor, AMissingControllerIsOneRow) {
  Bench bench;
  bench.options.wheels_off_the_ground = true;
  bench.no_drive = Error{ErrorCode::kTimeout, "drive: no answer"};
  const Row row = row_of(bench.examined(), "drive", "opens");
  EXPECT_EQ(row.verdict, kFailed);
  EXPECT_EQ(row.measured, "no answer");
  EXPECT_THAT(row.advice, HasSubstr("protocol, baud"));
}

TEST(Doctor, WithAnUnreadableMapAllPartsAreTested) {
  Bench bench;
  static_cast<void>(bench.folder.write("room.map.yaml", "bounds_m: 7\n"));
  const Report report = bench.examined();
  EXPECT_EQ(row_of(report, "files", "map").verdict, kFailed);
  EXPECT_EQ(row_of(report, "lower", "rate").verdict, kOk);
}

TEST(Doctor, InconsistentFilesAreReported) {
  Bench bench;
  bench.cameras = R"(
  lower: {driver: sim_povray, width_px: 160, height_px: 120, rate_hz: 25}
  upper: {driver: sim_povray, width_px: 160, height_px: 120, rate_hz: 25}
)";
  bench.drive = "sim_povray";
  const Row row = row_of(bench.examined(), "files", "consistency");
  EXPECT_EQ(row.verdict, kFailed);
  EXPECT_THAT(row.measured, HasSubstr("start is missing"));
}

TEST(Doctor, AnInterruptionEndsIt) {
  Bench bench;
  bench.options.wheels_off_the_ground = true;
  int sleeps = 130;
  bench.at_each_sleep = [&] { bench.stop = bench.stop || --sleeps == 0; };
  const Report report = bench.examined();
  EXPECT_EQ(report.rows().back().verdict, kFailed);
  EXPECT_THAT(report.rows().back().measured, HasSubstr("stopped from outside"));
}

TEST(Doctor, AnExceptionOfAPartIsItsFailure) {
  Bench bench;
  int questions = 0;
  bench.person = [&](const std::string&) -> std::optional<std::string> {
    if (++questions == 1) return "yes";
    throw std::runtime_error("the terminal broke");
  };
  const Report report = bench.examined();
  EXPECT_EQ(row_of(report, "drive", "exception").verdict, kFailed);
  EXPECT_EQ(row_of(report, "drive", "exception").measured, "the terminal broke");
}

TEST(Doctor, PartsWithoutDeviceAreTestedAsAWhole) {
  Bench bench;
  bench.cameras = kMemory;
  bench.drive = "memory";
  const Report report = bench.examined();
  EXPECT_EQ(report.count(kOk), report.rows().size()) << table(report);
  EXPECT_THAT(row_of(report, "lower", "driver").measured, HasSubstr("no bench test"));
  EXPECT_THAT(row_of(report, "robot", "pair").measured, HasSubstr("received"));
}

TEST(Doctor, AWholeRobotThatDoesNotOpenIsReported) {
  Bench bench;
  bench.cameras = kMemory;
  bench.drive = "memory";
  Openers openers;
  openers.robot = [](const drivers::RobotSettings&) -> Result<Robot> {
    return Error{ErrorCode::kUnavailable, "POV-Ray is not installed"};
  };
  const Report report = examine(bench.robot(), bench.options, openers, bench.surroundings());
  EXPECT_EQ(row_of(report, "robot", "opens").verdict, kFailed);
}

TEST(Doctor, RealCamerasWithoutADriveAreTested) {
  Bench bench;
  bench.drive = "memory";
  bench.options.wheels_off_the_ground = true;
  const Report report = bench.examined();
  EXPECT_EQ(row_of(report, "drive", "driver").verdict, kNotRun);
  EXPECT_EQ(row_of(report, "pair", "pairs").verdict, kOk);
}

}  // namespace
}  // namespace twocone::doctor
