// SPDX-License-Identifier: Apache-2.0
// Runs the checks of the drive with the serial driver and emulated controllers, in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "apps/doctor/checks/checks.h"
#include "tests/doctor/bench_devices.h"
#include "tests/emulator/arduino_emulator.h"
#include "tests/emulator/fd_bench.h"

namespace twocone::doctor {
namespace {

using namespace std::chrono_literals;

/// A controller, with its entry in the robot file.
struct Controller {
  const char* name;
  std::string firmware, protocol;
  double counts_per_turn;
  bool motors_crossed = false;
};
void PrintTo(const Controller& controller, std::ostream* out) { *out << controller.name; }

class Emulateds : public testing::TestWithParam<Controller> {};

Report checked_in_real_time(const Controller& controller) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) throw std::runtime_error("socketpair");
  Report report;
  {
    emulator::Server server(controller.firmware, ends[1]);
    if (controller.motors_crossed) {
      server.with([](emulator::Firmware& firmware) {
        dynamic_cast<emulator::ArduinoEmulator&>(firmware).motors_crossed = true;
      });
    }
    const DriveLimits limits{12, 500ms};
    serial::SerialDriveSettings settings;
    settings.port = "the emulator";
    settings.protocol = controller.protocol;
    settings.counts_per_turn = controller.counts_per_turn;
    const serial::SerialDriveSettings as_filed = settings;
    settings.least_speed_radps = 0;
    auto drive = serial::open_drive(
        settings, limits, {.connect = [&]() -> Result<serial::Connection> {
          return serial::Connection{std::make_unique<emulator::DescriptorTransport>(ends[0]), ends[0]};
        }});
    EXPECT_TRUE(drive) << drive.error().message;
    if (drive) {
      const SteadyClock clock;
      const std::atomic<bool> stop{false};
      const Surroundings surroundings{.clock = clock,
                                      .sleep = [](std::chrono::nanoseconds time) { std::this_thread::sleep_for(time); },
                                      .stop = stop};
      const DriveUnderTest test{{"serial_diffdrive", limits, as_filed}, 0.066};
      EXPECT_TRUE(check_standing_drive(test, **drive, surroundings, report)) << table(report);
      check_wheels(test, **drive, surroundings, report);
      std::this_thread::sleep_for(200ms);  // motors have inertia
      EXPECT_FALSE(server.turns());
    }
  }
  ::close(ends[1]);
  return report;
}

// A machine that is suspended for a moment spoils a measurement. A measurement that is wrong each time has another
// cause.
TEST_P(Emulateds, AreFoundInOrder) {
  constexpr int kTries = 4;
  Report report;
  for (int i = 0; i < kTries; ++i) {
    report = checked_in_real_time(GetParam());
    if (!report.has_failed()) break;
  }
  EXPECT_FALSE(report.has_failed()) << table(report);
  EXPECT_EQ(row_of(report, "drive", "stop, silence").verdict, kOk) << table(report);
  EXPECT_EQ(row_of(report, "drive", "left wheel").verdict, kOk) << table(report);
  EXPECT_THAT(row_of(report, "drive", "least speed").measured, testing::HasSubstr("turns both wheels"));
}

const Controller kProtocols[] = {
    {"ros_arduino_bridge", "ros_arduino_bridge", "ros_arduino_bridge", 1440},
    {"roboclaw", "roboclaw", "roboclaw", 508.8},
    {"create2", "create2", "create2", 508.8},
    {"arduino_emulator", std::string(emulator::kArduinoEmulator), "ros_arduino_bridge", 1440}};

INSTANTIATE_TEST_SUITE_P(Protocols, Emulateds, testing::ValuesIn(kProtocols),
                         [](const auto& each) { return std::string(each.param.name); });

// Catches the advice to check the encoders' wiring where each control loop drives the other wheel.
TEST(CrossedMotors, WithAControlLoopRunAwayAndTheirPlugsAreNamed) {
  const Report report =
      checked_in_real_time({"crossed", std::string(emulator::kArduinoEmulator), "ros_arduino_bridge", 1440, true});
  for (const char* wheel : {"left wheel", "right wheel"}) {
    const Row row = row_of(report, "drive", wheel);
    EXPECT_EQ(row.verdict, kFailed) << table(report);
    EXPECT_THAT(row.measured, testing::HasSubstr("ran away")) << table(report);
    EXPECT_THAT(row.advice, testing::HasSubstr("the two motors' plugs, not the encoders'")) << table(report);
  }
  EXPECT_EQ(row_of(report, "drive", "stop time").verdict, kNotRun) << "the wheels do not obey";
}

}  // namespace
}  // namespace twocone::doctor
