// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/diff_drive_conformance.h"
#include "tests/stand_in/plug.h"

/// The suite on serial drives whose controllers are stand-ins, in real time, each with a guard.
namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using serial::SerialDiffDrive;
using stand_in::Plug;

// ros_arduino_bridge takes whole counts in 33 ms: at so many in a turn, a single command is off by 0.012 rad/s at most.
constexpr double kCountsPerTurn = 8192;
// Create 2 has 508.8 counts in a turn, and takes whole mm/s, which are 0.014 rad/s.
constexpr double kResolution_rad = 0.013;
// Create 2 tells of itself every 15 ms, and an exchange of the others takes a few.
constexpr auto kJitter = 25ms;
constexpr auto kStep = 100ms;

OpenedDrive open_drive(const char* protocol, const DriveLimits& limits) {
  const auto plug = std::make_shared<Plug>(protocol);
  auto drive = SerialDiffDrive::open(plug->settings(kCountsPerTurn), limits, plug->connect());
  if (!drive) throw std::runtime_error(drive.error().message);
  const auto settle = [plug] { plug->server().catch_up(); };
  return {*std::move(drive), [](std::chrono::nanoseconds time) { std::this_thread::sleep_for(time); },
          [plug, settle] {
            settle();
            return plug->server().with(
                [](stand_in::Firmware& firmware) { return firmware.wheels.left() + 0.37 * firmware.wheels.right(); });
          },
          settle};
}

DriveCase case_of(const char* name, const char* protocol) {
  return {name, kStep, [protocol](const DriveLimits& limits) { return open_drive(protocol, limits); }, kJitter,
          kResolution_rad};
}

INSTANTIATE_TEST_SUITE_P(Serial, DiffDriveConformance,
                         testing::Values(case_of("RosArduinoBridge", "ros_arduino_bridge"),
                                         case_of("Roboclaw", "roboclaw"), case_of("Create2", "create2")),
                         drive_case_name);

}  // namespace
}  // namespace twocone::test
