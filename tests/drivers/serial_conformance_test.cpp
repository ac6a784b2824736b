// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/diff_drive_conformance.h"
#include "tests/emulator/plug.h"

/// Runs the suite for serial drives with emulated controllers, in real time, each with a watchdog.
namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using emulator::Plug;

// ros_arduino_bridge uses whole counts per 33 ms. With this number of counts per turn, a single command is off by at
// most 0.012 rad/s.
constexpr double kCountsPerTurn = 8192;
// Create 2 has 508.8 counts per turn, and uses whole mm/s, which are 0.014 rad/s.
constexpr double kResolution_rad = 0.013;
// Create 2 sends its state every 15 ms; an exchange with the others takes a few milliseconds.
constexpr auto kSerialJitter = 25ms;
constexpr auto kSerialStep = 100ms;

OpenedDrive open_serial_drive(const char* protocol, const DriveLimits& limits) {
  const auto plug = std::make_shared<Plug>(protocol);
  auto drive = serial::open_drive(plug->settings(kCountsPerTurn), limits, plug->machine());
  if (!drive) throw std::runtime_error(drive.error().message);
  const auto settle = [plug] { plug->server().catch_up(); };
  return {*std::move(drive), [](std::chrono::nanoseconds time) { std::this_thread::sleep_for(time); },
          [plug, settle] {
            settle();
            return plug->server().with(
                [](emulator::Firmware& firmware) { return firmware.wheels.left() + 0.37 * firmware.wheels.right(); });
          },
          settle};
}

DriveCase case_of(const char* name, const char* protocol) {
  return {name, kSerialStep, [protocol](const DriveLimits& limits) { return open_serial_drive(protocol, limits); },
          kSerialJitter, kResolution_rad};
}

INSTANTIATE_TEST_SUITE_P(Serial, DiffDriveConformance,
                         testing::Values(case_of("RosArduinoBridge", "ros_arduino_bridge"),
                                         case_of("Roboclaw", "roboclaw"), case_of("Create2", "create2")),
                         drive_case_name);

}  // namespace
}  // namespace twocone::test
