// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "drivers/memory/memory.h"
#include "tests/drivers/camera_conformance.h"
#include "tests/drivers/diff_drive_conformance.h"
#include "tests/support/faulty_camera.h"
#include "tests/support/faulty_diffdrive.h"
#include "tests/support/real_time_camera.h"

namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using memory::MemoryCamera;
using memory::MemoryDiffDrive;
using std::chrono::nanoseconds;
using testing_support::FaultyCamera;
using testing_support::FaultyDiffDrive;
using testing_support::RealTimeCamera;

OpenedCamera open_memory_camera() {
  auto clock = std::make_shared<ManualClock>();
  return {std::make_unique<MemoryCamera>(clock), [clock](nanoseconds time) { clock->advance(time); }};
}

OpenedCamera open_real_time_camera() {
  return {std::make_unique<RealTimeCamera>(), [](nanoseconds time) { std::this_thread::sleep_for(time); }};
}

/// A cable without a fault must behave like no cable.
OpenedCamera behind_a_cable(OpenedCamera opened) {
  return {std::make_unique<FaultyCamera>(std::move(opened.camera), testing_support::CameraFaults{}, 1), opened.pass};
}

// The periods of these rates are not whole nanoseconds, so a sum of rounded periods is detected.
const CameraCase kMemoryCamera{"Memory", {64, 48, 15}, 0ns, open_memory_camera};
const CameraCase kMemoryCable{"FaultlessCable", {64, 48, 15}, 0ns, [] { return behind_a_cable(open_memory_camera()); }};
const CameraCase kRealTimeCamera{"RealTime", {64, 48, 60}, 0ns, open_real_time_camera};
const CameraCase kRealTimeCable{
    "FaultlessCableInRealTime", {64, 48, 60}, 0ns, [] { return behind_a_cable(open_real_time_camera()); }};
const auto kMemoryCameras = testing::Values(kMemoryCamera, kMemoryCable, kRealTimeCamera, kRealTimeCable);

INSTANTIATE_TEST_SUITE_P(Memory, CameraConformance, kMemoryCameras, camera_case_name);
INSTANTIATE_TEST_SUITE_P(Memory, CameraThatDoesNotWait, kMemoryCameras, camera_case_name);
INSTANTIATE_TEST_SUITE_P(Memory, CameraInLockStep, testing::Values(kMemoryCamera, kMemoryCable), camera_case_name);

OpenedDrive open_drive(std::shared_ptr<const Clock> clock, std::function<void(nanoseconds)> pass,
                       const DriveLimits& limits) {
  auto drive = std::make_unique<MemoryDiffDrive>(std::move(clock), limits);
  const auto wheels = drive->wheels();
  return {std::move(drive), std::move(pass), [wheels] { return wheels->angles().left_rad; }};
}

OpenedDrive open_manual_drive(const DriveLimits& limits) {
  auto clock = std::make_shared<ManualClock>();
  return open_drive(
      clock, [clock](nanoseconds time) { clock->advance(time); }, limits);
}

OpenedDrive open_steady_drive(const DriveLimits& limits) {
  return open_drive(
      std::make_shared<SteadyClock>(), [](nanoseconds time) { std::this_thread::sleep_for(time); }, limits);
}

OpenedDrive behind_a_cable(OpenedDrive opened) {
  return {std::make_unique<FaultyDiffDrive>(std::move(opened.drive), testing_support::DriveFaults{}, 1), opened.pass,
          opened.way};
}

// On the steady clock a step is long compared with the delay that an idle machine adds to a sleep. For a busy machine,
// drive_for() tries again.
INSTANTIATE_TEST_SUITE_P(
    Memory, DiffDriveConformance,
    testing::Values(DriveCase{"MemoryManualClock", 37ms, open_manual_drive},
                    DriveCase{"MemorySteadyClock", 50ms, open_steady_drive},
                    DriveCase{"FaultlessCableManualClock", 37ms,
                              [](const DriveLimits& limits) { return behind_a_cable(open_manual_drive(limits)); }},
                    DriveCase{"FaultlessCableSteadyClock", 50ms,
                              [](const DriveLimits& limits) { return behind_a_cable(open_steady_drive(limits)); }}),
    drive_case_name);

}  // namespace
}  // namespace twocone::test
