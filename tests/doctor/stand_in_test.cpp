// SPDX-License-Identifier: Apache-2.0
// The drive's checks over the serial driver and stand-ins for the controllers, in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "apps/doctor/drive_checks.h"
#include "tests/doctor/bench_devices.h"
#include "tests/stand_in/fd_bench.h"

namespace twocone::doctor {
namespace {

using namespace std::chrono_literals;

class StandIns : public testing::TestWithParam<const char*> {};

serial::SerialDriveSettings settings_for(const std::string& protocol) {
  serial::SerialDriveSettings settings;
  settings.port = "the stand-in";
  settings.protocol = protocol;
  settings.counts_per_turn = 508.8;
  return settings;
}

Report checked(const std::string& protocol) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) throw std::runtime_error("socketpair");
  Report report;
  {
    stand_in::Server server(protocol, ends[1]);
    const DriveLimits limits{12, 500ms};
    const auto settings = settings_for(protocol);
    auto drive = serial::SerialDiffDrive::open(settings, limits, [&]() -> Result<serial::Connection> {
      return serial::Connection{std::make_unique<stand_in::DescriptorWire>(ends[0]), ends[0]};
    });
    EXPECT_TRUE(drive) << drive.error().message;
    if (drive) {
      const SteadyClock clock;
      const std::atomic<bool> stop{false};
      const Surroundings surroundings{.clock = clock,
                                      .sleep = [](std::chrono::nanoseconds time) { std::this_thread::sleep_for(time); },
                                      .stop = stop};
      const DriveUnderTest test{{"serial_diffdrive", limits, settings}, 0.066};
      EXPECT_TRUE(check_drive_at_rest(test, **drive, surroundings, report)) << table(report);
      check_wheels(test, **drive, surroundings, report);
      EXPECT_FALSE(server.turns());
    }
  }
  ::close(ends[1]);
  return report;
}

// A machine that stands still for a moment spoils a measurement; one that is wrong each time is not the machine's.
TEST_P(StandIns, AreFoundInOrder) {
  constexpr int kTries = 4;
  Report report;
  for (int i = 0; i < kTries; ++i) {
    report = checked(GetParam());
    if (!report.has_failed()) break;
  }
  EXPECT_FALSE(report.has_failed()) << table(report);
  EXPECT_EQ(row_of(report, "drive", "stop, silence").verdict, Verdict::kOk) << table(report);
  EXPECT_EQ(row_of(report, "drive", "left wheel").verdict, Verdict::kOk) << table(report);
}

INSTANTIATE_TEST_SUITE_P(Protocols, StandIns, testing::Values("ros_arduino_bridge", "roboclaw", "create2"),
                         [](const auto& each) { return std::string(each.param); });

}  // namespace
}  // namespace twocone::doctor
