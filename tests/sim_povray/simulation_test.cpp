// SPDX-License-Identifier: Apache-2.0
// The lock-step of cameras, drive and world, with images that the test finishes.
#include "drivers/sim_povray/simulation.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/simulation_host.h"
#include "tests/sim_povray/hand_renderer.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/error_of.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr const char* kOneRobotScene =
    "union { //*PMName robot\n}\ncamera { //*PMName lower\n}\ncamera { //*PMName upper\n}\n";

class SimulationTest : public testing::Test {
 protected:
  SimulationTest() {
    place_.scene = "lab.pov";
    settings_.body.start = {0.31, -0.47, 0.83};
    settings_.run_ahead_frames = 3;
    open();
  }

  void open() {
    desk_ = std::make_shared<HandRenderer::Desk>();
    auto host = value(SimulationHost::open(place_, scene_, std::make_unique<HandRenderer>(desk_)));
    simulation_ = value(Simulation::join(*host, settings_));
  }

  std::unique_ptr<Camera> streaming(const std::string& name, double rate_hz = 15) {
    return sim_povray::streaming(*simulation_, {name, 1, {}}, {64, 48, rate_hz});
  }

  /// Grabs a frame and finishes its image, so that the run-ahead limit has no effect.
  Frame::Header grab(Camera& camera) {
    const Frame frame = value(camera.grab(kHandLimit));
    desk_->finish(desk_->jobs.size() - 1);
    return frame.header();
  }

  const Scene scene_ = *Scene::parse(kOneRobotScene, "lab.pov");
  PlaceSettings place_;
  SessionSettings settings_;
  std::shared_ptr<HandRenderer::Desk> desk_;
  std::unique_ptr<Simulation> simulation_;
};

TEST_F(SimulationTest, TwoCamerasInTurnSeeOneStep) {
  auto lower = streaming("lower");
  auto upper = streaming("upper");
  for (std::uint64_t step = 0; step < 5; ++step) {
    const auto a = grab(*lower);
    const auto b = grab(*upper);
    EXPECT_EQ(a.sequence, step);
    EXPECT_EQ(b.sequence, step);
    EXPECT_EQ(a.captured, b.captured);
    EXPECT_EQ(a.captured.clock, ClockKind::kSimulated);
    EXPECT_EQ(a.captured.since_zero.count(), std::llround(double(step) * 1e9 / 15));
    EXPECT_EQ(a.lost_before, 0U);
    EXPECT_EQ(b.lost_before, 0U);
  }
}

// Catches frames that belong to one step and show another: both texts must contain the same matrix.
TEST_F(SimulationTest, BothViewsShowThePoseOfTheirStep) {
  auto lower = streaming("lower");
  auto upper = streaming("upper");
  auto drive = simulation_->open_drive();
  auto truth = simulation_->open_truth();
  for (int i = 0; i < 3; ++i) {
    (void)drive->set_speeds({2.1, 3.4});
    grab(*lower);
    grab(*upper);
  }
  const FloorMotion motion = motion_between(settings_.body.start, truth->true_pose());
  EXPECT_NE(truth->true_pose(), settings_.body.start);
  EXPECT_EQ(desk_->jobs[4].pose, desk_->jobs[5].pose);
  EXPECT_EQ(desk_->jobs[4].pose, scene_.pose_text({motion}, motion, place_.unit_m)) << "robot and camera move together";
  EXPECT_EQ(desk_->jobs[0].pose, scene_.pose_text({FloorMotion{}}, FloorMotion{}, place_.unit_m));
  EXPECT_EQ(desk_->jobs[4].label, "frame 2, view lower");
  EXPECT_EQ(desk_->jobs[5].label, "frame 2, view upper");
  EXPECT_EQ(desk_->jobs[5].view_template->width_px, 64);
  EXPECT_EQ(desk_->jobs[5].view_template->height_px, 48);
}

TEST_F(SimulationTest, GrabbingOneCameraTwiceLosesAStepOfTheOther) {
  auto lower = streaming("lower");
  auto upper = streaming("upper");
  grab(*lower);
  grab(*upper);
  EXPECT_EQ(grab(*lower).sequence, 1U);
  EXPECT_EQ(grab(*lower).sequence, 2U);
  const auto late = grab(*upper);
  EXPECT_EQ(late.sequence, 2U);
  EXPECT_EQ(late.lost_before, 1U);
  EXPECT_EQ(grab(*upper).lost_before, 0U);
}

TEST_F(SimulationTest, AfterARestartTheStreamContinues) {
  auto lower = streaming("lower");
  auto upper = streaming("upper");
  EXPECT_EQ(grab(*lower).sequence, 0U);
  lower->stop();
  ASSERT_TRUE(lower->start());
  EXPECT_EQ(grab(*lower).sequence, 1U) << "a step is returned once";
  lower->stop();
  for (int i = 0; i < 4; ++i) grab(*upper);
  ASSERT_TRUE(lower->start());
  const auto frame = grab(*lower);
  EXPECT_EQ(frame.sequence, 4U);
  EXPECT_EQ(frame.lost_before, 0U) << "a stopped camera loses nothing";
}

TEST_F(SimulationTest, OnlyAGrabMovesTheWorld) {
  auto lower = streaming("lower");
  auto drive = simulation_->open_drive();
  auto truth = simulation_->open_truth();
  grab(*lower);
  (void)drive->set_speeds({3, 3});
  for (int i = 0; i < 3; ++i) (void)drive->read_angles();
  EXPECT_EQ(truth->true_pose(), settings_.body.start);
  EXPECT_EQ(drive->read_angles()->time.since_zero, 0ns);
  grab(*lower);
  EXPECT_NE(truth->true_pose(), settings_.body.start);
  EXPECT_EQ(drive->read_angles()->time.since_zero, 66'666'667ns);
}

// ---- run-ahead

TEST_F(SimulationTest, RunsAheadByTheStatedNumberOfSteps) {
  auto lower = streaming("lower");
  auto upper = streaming("upper");
  auto truth = simulation_->open_truth();
  auto drive = simulation_->open_drive();
  (void)drive->set_speeds({3, 3});
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(lower->grab(0ms)) << "step " << i;
    ASSERT_TRUE(upper->grab(0ms)) << "step " << i;
  }
  const Pose2 before = truth->true_pose();
  EXPECT_THAT(lower->grab(kHandTimeout), FailsWith(ErrorCode::kTimeout, HasSubstr("frame 0")));
  EXPECT_EQ(truth->true_pose(), before) << "a grab that fails must not step the world";
  EXPECT_EQ(desk_->jobs.size(), 6U);

  desk_->finish(0);
  EXPECT_FALSE(lower->grab(kHandTimeout)) << "step 0 has one image, not both";
  desk_->finish(1);
  const auto later = value(lower->grab(0ms));
  EXPECT_EQ(later.header().sequence, 3U);
  EXPECT_EQ(later.header().lost_before, 0U);
}

TEST_F(SimulationTest, AWaitingGrabContinuesWhenTheImageArrives) {
  auto lower = streaming("lower");
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(lower->grab(0ms));
  std::thread worker([this] {
    std::this_thread::sleep_for(kHandTimeout);
    desk_->finish(1);  // a newer image is finished first: the grab waits for the oldest
    desk_->finish(0);
  });
  const auto frame = lower->grab(kHandLimit);
  worker.join();
  ASSERT_TRUE(frame) << frame.error().message;
}

// Catches a limit that counts failed images as unfinished: the simulation would lock up.
TEST_F(SimulationTest, AFailedImageFreesItsPlaceAndKeepsItsError) {
  settings_.run_ahead_frames = 1;
  open();
  auto lower = streaming("lower");
  const auto first = value(lower->grab(0ms));
  desk_->fail(0);
  (void)value(lower->grab(0ms));
  EXPECT_THAT(first.image(0ms), FailsWith(ErrorCode::kDisconnected));
}

TEST_F(SimulationTest, PixelsMayArriveLater) {
  auto lower = streaming("lower");
  const auto frame = value(lower->grab(0ms));
  EXPECT_THAT(frame.image(0ms), FailsWith(ErrorCode::kTimeout));
  desk_->finish(0);
  EXPECT_TRUE(frame.image(0ms));
}

// ---- configuration

TEST_F(SimulationTest, OneRateForAllCameras) {
  auto lower = simulation_->open_camera({"lower", 1, {}});
  auto upper = simulation_->open_camera({"upper", 1, {}});
  ASSERT_TRUE((*lower)->configure({64, 48, 15}));
  const auto other = (*upper)->configure({64, 48, 30});
  ASSERT_THAT(other, FailsWith(ErrorCode::kRefused,
                               AllOf(HasSubstr("'upper' wants 30 Hz"), HasSubstr("'lower' runs at 15 Hz"))));
  EXPECT_EQ((*upper)->state(), Camera::State::kClosed);
  EXPECT_TRUE((*upper)->configure({32, 24, 15})) << "sizes may differ";
  (*upper).reset();
  EXPECT_TRUE((*lower)->configure({64, 48, 40})) << "no other camera has another rate";
}

TEST_F(SimulationTest, APairCanBeRestartedAtAnotherRate) {
  StereoRig rig(std::move(*simulation_->open_camera({"lower", 1, {}})),
                std::move(*simulation_->open_camera({"upper", 1, {}})), 0ns);
  ASSERT_TRUE(rig.start({64, 48, 15}, {64, 48, 15}));
  ASSERT_TRUE(rig.grab(0ms));
  rig.stop();
  value(rig.start({64, 48, 20}, {64, 48, 20}));
  const auto pair = value(rig.grab(0ms));
  EXPECT_EQ(pair.lower.header().captured.since_zero, 50ms);
}

TEST_F(SimulationTest, AStoppedCameraCannotRestartAtAnOldRate) {
  auto lower = streaming("lower");
  lower->stop();
  auto upper = streaming("upper", 30);
  EXPECT_THAT(lower->start(), FailsWith(ErrorCode::kRefused));
}

TEST_F(SimulationTest, RefusesSettingsThatCannotBeRendered) {
  auto camera = simulation_->open_camera({"lower", 1, {}});
  for (const CameraSettings& bad :
       {CameraSettings{64, 48, 1e-9}, CameraSettings{64, 48, 1e12}, CameraSettings{100000, 48, 15}}) {
    EXPECT_THAT((*camera)->configure(bad), FailsWith(ErrorCode::kRefused));
  }
  EXPECT_EQ((*camera)->configure({63, 47, 12.5}).value(), (CameraSettings{63, 47, 12.5})) << "applied as requested";
}

TEST_F(SimulationTest, RefusesMissingCameras) {
  EXPECT_THAT(simulation_->open_camera({"rear", 1, {}}),
              FailsWith(ErrorCode::kRefused, HasSubstr("lab.pov: no camera 'rear'")));
  EXPECT_THROW((void)simulation_->open_camera({"", 1, {}}), std::invalid_argument);
  EXPECT_THROW((void)simulation_->open_camera({"lower", 0, {}}), std::invalid_argument);
}

// ---- drive

TEST_F(SimulationTest, AnglesCountFromTheOpeningOfTheDrive) {
  settings_.body.wheels.encoder_counts_per_turn = 100;
  open();
  auto lower = streaming("lower");
  auto first = simulation_->open_drive();
  (void)first->set_speeds({1.3, -2.1});
  grab(*lower);
  grab(*lower);
  const auto angles = value(first->read_angles());
  constexpr double kCount_rad = 2 * std::numbers::pi / 100;
  // In a fifteenth of a second the wheels turn 1.379 counts forward and 2.228 backward, rounded down.
  EXPECT_DOUBLE_EQ(angles.left_rad, 1 * kCount_rad);
  EXPECT_DOUBLE_EQ(angles.right_rad, -3 * kCount_rad);
  auto second = simulation_->open_drive();
  EXPECT_EQ(second->read_angles()->left_rad, 0);
  EXPECT_EQ(second->read_angles()->right_rad, 0);
}

TEST_F(SimulationTest, DestroyingTheDriveStopsTheWheels) {
  auto lower = streaming("lower");
  auto truth = simulation_->open_truth();
  grab(*lower);
  (void)simulation_->open_drive()->set_speeds({3, 3});
  grab(*lower);
  EXPECT_EQ(truth->true_pose(), settings_.body.start);
}

TEST_F(SimulationTest, OpenedDevicesOutliveTheSimulation) {
  auto lower = streaming("lower");
  auto drive = simulation_->open_drive();
  auto truth = simulation_->open_truth();
  simulation_.reset();
  (void)drive->set_speeds({3, 3});
  grab(*lower);
  grab(*lower);
  EXPECT_NE(truth->true_pose(), settings_.body.start);
  lower.reset();
  EXPECT_TRUE(drive->stop());
}

// ---- settings

TEST(SettingsCheck, NamesEveryBadField) {
  PlaceSettings place{.unit_m = 0,
                      .walls = Bounds{1, -1, 0, 2},
                      .solids = {{"landmark red", Disc{{0, 0}, -1}}, {"obstacle 2", Outline{{0, 0}, {1, 0}}}},
                      .moving = {{"trolley", {{0, 0}, {0, 0}}, 0, true, 0}}};
  place.switches.reflection_depth = 0;
  place.render = {.povray = "", .processes = 0, .timeout = 0ms};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const SessionSettings s{.body = {.start = {0, 0, std::numeric_limits<double>::quiet_NaN()},
                                   .radius_m = -0.2,
                                   .wheels = {-0.3, kInfinity, -0.1, 0, -1, -1},
                                   .physics = Physics{0, 0, -1},
                                   .begin = Pose2{kInfinity, 0, 0}},
                          .drive = {.max_speed_radps = 0},
                          .run_ahead_frames = 0};
  const ViewSettings view{"",
                          10,
                          {.gain = 0,
                           .read_noise_electrons = 2,
                           .vignetting = 1.5,
                           .shutter_samples = 1,
                           .distortion = {0.1},
                           .drop_probability = 1,
                           .stamp_late_s = 0.501,
                           .colour_gain = {1.1, -0.2},
                           .flicker = 1.01,
                           .jpeg_quality = 101}};
  const auto complaint = [](const auto& settings) {
    return testing_support::error_of<std::invalid_argument>([&] { check(settings); });
  };
  for (const char* field :
       {"scene is empty", "unit_m is 0 m", "min_x_m is 1 m and max_x_m -1 m", "landmark red.radius_m is -1 m",
        "obstacle 2 has 2 corners", "speed_mps is 0 m/s", "path_m[1] is that of [0]",
        "reflection_depth is 0, must be 1 to 256", "render.povray", "processes is 0", "timeout is 0 ms"}) {
    EXPECT_THAT(complaint(place), HasSubstr(field));
  }
  for (const char* field : {"start.heading_rad is nan rad", "begin.x_m is inf m", "radius_m is -0.2 m",
                            "separation_m is -0.3 m", "radius_m is inf m", "slip is -0.1", "slip_correlation_s is 0 s",
                            "lag_s is -1 s", "encoder_counts_per_turn is -1", "mass_kg is 0 kg", "wheel_friction is 0",
                            "body_friction is -1", "max_speed_radps is 0", "run_ahead_frames is 0"}) {
    EXPECT_THAT(complaint(s), HasSubstr(field));
  }
  for (const char* field :
       {"camera_name is empty", "antialias is 10, must be 1 to 9", "gain is 0", "needs full_well_electrons",
        "vignetting is 1.5", "shutter_samples is 1, must be 2 to 64", "distortion has 1 terms",
        "distortion_focal_px is 0", "drop_probability is 1", "stamp_late_s is 0.501 s, must be 0 to 0.5",
        "colour_gain has 2 numbers, must be 3", "colour_gain is -0.2", "flicker is 1.01, must be 0 to 1",
        "jpeg_quality is 101, must be 0 to 100"}) {
    EXPECT_THAT(complaint(view), HasSubstr(field));
  }
}

TEST(SimulationOpen, RefusesAMissingSceneAndAMissingProgram) {
  const TemporaryFolder folder;
  PlaceSettings place{.scene = folder.path() / "none.pov"};
  EXPECT_THAT(Simulation::open(place, {}), FailsWith(ErrorCode::kNotFound));

  place.scene = folder.write("lab.pov", kOneRobotScene);
  place.render.povray = "no-such-program";
  EXPECT_THAT(
      Simulation::open(place, {}),
      FailsWith(ErrorCode::kUnavailable,
                "POV-Ray is not installed: no program 'no-such-program' in PATH; on Debian: apt install povray; "
                "or use --renderer native, which renders many scenes without it, unchecked"));

  // A user can correct a scene without POV-Ray, so an error of the scene is reported first.
  place.scene = folder.write("open.pov", "union { //*PMName robot\n");
  EXPECT_THAT(Simulation::open(place, {}), FailsWith(ErrorCode::kRefused));
}

}  // namespace
}  // namespace twocone::sim_povray
