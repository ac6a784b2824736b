// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "drivers/sim_povray/simulation.h"
#include "tests/drivers/camera_conformance.h"
#include "tests/drivers/diff_drive_conformance.h"
#include "tests/support/value.h"

/// Runs the suites for a world that POV-Ray renders. The images are small, so their number determines the time.
namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using sim_povray::Simulation;
using std::chrono::nanoseconds;
using testing_support::value;

std::unique_ptr<Simulation> open_world(const DriveLimits& limits) {
  sim_povray::PlaceSettings place;
  place.scene = TWOCONE_SOURCE_DIR "/tests/sim_povray/scenes/tiny.pov";
  sim_povray::SessionSettings session;
  session.drive = limits;
  return value(Simulation::open(place, session));
}

OpenedCamera open_camera() { return {value(open_world({})->open_camera({"lower", 1, {}})), nullptr}; }

const CameraCase kCamera{"SimPovray", {64, 48, 15}, 0ns, open_camera};

INSTANTIATE_TEST_SUITE_P(SimPovray, CameraConformance, testing::Values(kCamera), camera_case_name);
INSTANTIATE_TEST_SUITE_P(SimPovray, CameraInLockStep, testing::Values(kCamera), camera_case_name);
// Time passes only by grabs.
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraThatDoesNotWait);

/// The step is 250 ms: few frames and so few images, and the turn that AnglesDoNotWrap needs is not a whole number of
/// steps.
constexpr double kRate_hz = 4;
constexpr auto kRenderedStep = nanoseconds(1s) / 4;

OpenedDrive open_simulated_drive(const DriveLimits& limits) {
  const auto world = open_world(limits);
  auto drive = world->open_drive();
  const std::shared_ptr<GroundTruth> truth = world->open_truth();
  const std::shared_ptr<Camera> camera = value(world->open_camera({"lower", 1, {}}));
  const auto grab = [camera] { return value(camera->grab(30s)); };
  (void)value(camera->configure({8, 6, kRate_hz}));
  value(camera->start());
  (void)grab();  // the frame of the start, which advances no time
  return {std::move(drive),
          [grab](nanoseconds time) {
            for (; time >= kRenderedStep; time -= kRenderedStep) (void)grab();
            if (time.count() != 0) throw std::logic_error("time passes in whole frames here");
          },
          [truth] {
            const Pose2 pose = truth->true_pose();
            return pose.x_m + 0.37 * pose.y_m + pose.heading_rad;  // changes if any of the three changes
          }};
}

INSTANTIATE_TEST_SUITE_P(SimPovray, DiffDriveConformance,
                         testing::Values(DriveCase{"SimPovray", kRenderedStep, open_simulated_drive}), drive_case_name);

}  // namespace
}  // namespace twocone::test
