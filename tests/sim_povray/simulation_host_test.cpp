// SPDX-License-Identifier: Apache-2.0
// Several robots in one world: joining, lock-step, images, and cameras with time effects.
#include "drivers/sim_povray/simulation_host.h"
#include "drivers/sim_povray/place.h"

#include <future>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/scene/scene.h"
#include "drivers/sim_povray/simulation.h"
#include "tests/sim_povray/hand_renderer.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr const char* kTwoRobotScene =
    "union { //*PMName robot.1\n}\nunion { //*PMName robot.2\n}\nunion { //*PMName moving.trolley\n}\n"
    "camera { //*PMName lower.1\n}\ncamera { //*PMName lower.2\n}\n";

RobotSession::SteadyTime due_in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

class SimulationHostTest : public testing::Test {
 protected:
  SimulationHostTest() {
    place_.scene = "pair.pov";
    place_.moving = {{"trolley", {{0, 2}, {1, 2}}, 0.5, true, 0.1}};
    desk_->at_once = true;
    host_ = value(SimulationHost::open(place_, scene_, std::make_unique<HandRenderer>(desk_)));
  }

  SessionSettings settings(const std::string& name, double x_m) {
    return {.name = name, .body = {.start = {x_m, 0, 0}, .radius_m = 0.2}};
  }
  std::unique_ptr<RobotSession> joined(const std::string& name, double x_m) {
    return value(host_->join(settings(name, x_m)));
  }
  static void configure(RobotSession& session) {
    value(session.configure_view(value(session.open_view({"lower", 1, {}})), kSmallSize));
  }
  std::string refusal(const SessionSettings& wanted) {
    const auto session = host_->join(wanted);
    return session ? "accepted" : session.error().message;
  }

  const Scene scene_ = *Scene::parse(kTwoRobotScene, "pair.pov");
  PlaceSettings place_;
  std::shared_ptr<HandRenderer::Desk> desk_ = std::make_shared<HandRenderer::Desk>();
  std::shared_ptr<SimulationHost> host_;
};

TEST_F(SimulationHostTest, ARobotJoinsOnceAndByItsName) {
  const auto one = joined("1", 0);
  EXPECT_EQ(refusal(settings("1", 0)), "robot.1 is taken by another program");
  EXPECT_THAT(refusal(settings("3", 0)), HasSubstr("no object 'robot.3' for the robot '3'; the scene's robots are: "
                                                   "robot.1, robot.2"));
  EXPECT_EQ(refusal(settings("2", 0.3)), "start of robot.2 touches robot.1");
  SessionSettings placed = settings("2", 0.3);
  placed.body.start_place = "robots/two.yaml:17";
  EXPECT_EQ(refusal(placed), "robots/two.yaml:17: start of robot.2 touches robot.1");
  EXPECT_EQ(refusal(settings("2", 0.5)), "accepted");
}

// Catches a robot whose map differs from the world: its ranges would be wrong by the difference.
TEST_F(SimulationHostTest, ARobotWithAnotherMapIsRefusedAndTheDifferenceNamed) {
  SessionSettings other = settings("1", 0);
  PlaceSettings believed = place_;
  believed.moving[0].path_m[1].x_m = 1.649;
  other.map_outline = outline_of(believed);
  EXPECT_THAT(
      host_->join(other),
      FailsWith(ErrorCode::kRefused,
                testing::AllOf(HasSubstr("the robot's map is not that of this world: the map has moving trolley"),
                               HasSubstr("(1.649, 2.000)"), HasSubstr("; the world has moving trolley"))));
  other.map_outline = outline_of(place_);
  EXPECT_TRUE(host_->join(other));
}

// Catches a world that steps without one of its robots, or twice.
TEST_F(SimulationHostTest, TheWorldStepsOnceWhenAllHaveAsked) {
  const auto one = joined("1", 0);
  const auto two = joined("2", 1);
  configure(*one);
  configure(*two);
  EXPECT_THAT(one->step(due_in(kHandTimeout)), FailsWith(ErrorCode::kTimeout, "the world waits for robot.2"));
  EXPECT_EQ(one->state().step, 0U);
  for (std::uint64_t step = 1; step <= 20; ++step) {
    auto other = std::async(std::launch::async, [&] { return two->step(due_in(kHandLimit)); });
    value(one->step(due_in(kHandLimit)));
    ASSERT_TRUE(other.get());
    ASSERT_EQ(one->state().step, step);
    ASSERT_EQ(two->state().step, step);
    ASSERT_EQ(one->state().now, 100ms * step);
  }
}

// Catches a request for a step of a world without a rate, which would crash a served world.
TEST_F(SimulationHostTest, WithoutAConfiguredCameraThereIsNoStep) {
  const auto one = joined("1", 0);
  EXPECT_THAT(one->step(due_in(kHandTimeout)), FailsWith(ErrorCode::kInvalidState));
  configure(*one);
  EXPECT_TRUE(one->step(due_in(kHandTimeout)));
}

TEST_F(SimulationHostTest, ARobotThatLeavesIsNotWaitedForAndStops) {
  const auto one = joined("1", 0);
  auto two = joined("2", 1);
  configure(*one);
  configure(*two);
  (void)two->command({3, 3});
  auto waiting = std::async(std::launch::async, [&] { return one->step(due_in(kHandLimit)); });
  std::this_thread::sleep_for(kHandTimeout);
  two.reset();
  ASSERT_TRUE(waiting.get()) << "the world still waits for the robot that left";
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(one->step(due_in(kHandLimit)));
  // The robot stays where it was left. A robot that joins again with this name starts at its start pose.
  EXPECT_EQ(joined("2", 1.5)->state().pose, (Pose2{1.5, 0, 0}));
}

TEST_F(SimulationHostTest, AnEmptyWorldStartsAgainAtTimeZero) {
  auto one = joined("1", 0);
  configure(*one);
  (void)one->command({3, 3});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(one->step(due_in(kHandLimit)));
  EXPECT_NE(one->state().pose, (Pose2{0, 0, 0}));
  one.reset();
  one = joined("1", 0);
  EXPECT_EQ(one->state().step, 0U);
  EXPECT_EQ(one->state().now, 0ns);
  EXPECT_EQ(one->state().pose, (Pose2{0, 0, 0}));
  EXPECT_EQ(one->state().left_rad, 0);
}

// Catches images in which only the robot with the camera has moved.
TEST_F(SimulationHostTest, EveryImageShowsAllMovingObjects) {
  const auto one = joined("1", 0);
  const auto two = joined("2", 1);
  configure(*one);
  configure(*two);
  (void)one->command({2, 2});
  (void)two->command({-4, -4});
  auto other = std::async(std::launch::async, [&] { return two->step(due_in(kHandLimit)); });
  ASSERT_TRUE(one->step(due_in(kHandLimit)));
  ASSERT_TRUE(other.get());
  (void)one->image(0);
  (void)two->image(0);
  const FloorMotion first = motion_between({0, 0, 0}, one->state().pose);
  const FloorMotion second = motion_between({1, 0, 0}, two->state().pose);
  const FloorMotion trolley = motion_between({0, 2, 0}, {0.05, 2, 0});
  EXPECT_GT(first.x_m, 0);
  EXPECT_LT(second.x_m, 0);
  ASSERT_EQ(desk_->jobs.size(), 2U);
  EXPECT_EQ(desk_->jobs[0].pose, scene_.pose_text({first, second, trolley}, first, place_.unit_m));
  EXPECT_EQ(desk_->jobs[1].pose, scene_.pose_text({first, second, trolley}, second, place_.unit_m));
}

// Catches a late stamp that applies to the robot with the camera only: other objects would appear at wrong places.
TEST_F(SimulationHostTest, ALateStampShowsAllMovingObjectsAtTheEarlierTime) {
  const auto one = joined("1", 0);
  const auto two = joined("2", 1);
  CameraEffects effects{.stamp_late_s = 0.1};
  ASSERT_TRUE(one->open_view({"lower", 1, effects}));
  ASSERT_TRUE(one->configure_view(0, kSmallSize));
  configure(*two);
  const auto step = [&] {
    (void)one->command({2, 3});
    (void)two->command({-4, -3});
    auto other = std::async(std::launch::async, [&] { return two->step(due_in(kHandLimit)); });
    ASSERT_TRUE(one->step(due_in(kHandLimit)));
    ASSERT_TRUE(other.get());
  };
  step();
  const FloorMotion first = motion_between({0, 0, 0}, one->state().pose);
  const FloorMotion second = motion_between({1, 0, 0}, two->state().pose);
  step();
  EXPECT_GT(one->state().pose.x_m, first.x_m);
  (void)one->image(0);
  ASSERT_EQ(desk_->jobs.size(), 1U);
  EXPECT_EQ(desk_->jobs[0].pose,
            scene_.pose_text({first, second, motion_between({0, 2, 0}, {0.05, 2, 0})}, first, place_.unit_m));
}

TEST_F(SimulationHostTest, AMovingThingMustBeInTheScene) {
  place_.moving[0].name = "cart";
  EXPECT_THAT(SimulationHost::open(place_, scene_, std::make_unique<HandRenderer>(desk_)),
              FailsWith(ErrorCode::kRefused, HasSubstr("pair.pov: no object 'moving.cart'")));
}

// ---- cameras that take time, lose frames or are late

class CameraTimeTest : public SimulationHostTest {
 protected:
  std::unique_ptr<Simulation> simulation(const std::string& name = "1") {
    auto wanted = settings(name, 0);
    wanted.body.seed = 7;
    wanted.run_ahead_frames = 1000;
    return value(Simulation::join(*host_, wanted));
  }
  static std::unique_ptr<Camera> streaming(Simulation& simulation, const CameraEffects& effects) {
    return sim_povray::streaming(simulation, {"lower", 1, effects});
  }
};

// Catches a time stamp at the end of the exposure, and a truth of another time than the image.
TEST_F(CameraTimeTest, AnExposureIsStampedInItsMiddle) {
  CameraEffects effects{.exposure_time_s = 0.02, .readout_s = 0.04, .shutter_samples = 3};
  const auto world = simulation();
  const auto camera = streaming(*world, effects);
  const auto drive = world->open_drive();
  const auto truth = world->open_truth();
  (void)camera->grab(0ms);
  (void)drive->set_speeds({2, 2});
  const auto frame = value(camera->grab(0ms));
  EXPECT_EQ(frame.header().captured.since_zero, 70ms);
  // 2 rad/s on wheels of 0.05 m, for 70 ms.
  EXPECT_NEAR(truth->true_pose().x_m, 0.007, 1e-12);
  ASSERT_EQ(desk_->jobs.size(), 6U);
  EXPECT_EQ(desk_->jobs[0].pose, desk_->jobs[2].pose) << "before time 0 everything stands";
  // The shutter samples are in the middles of the thirds of 60 ms that end at 100 ms: at 50, 70 and 90 ms.
  EXPECT_EQ(
      desk_->jobs[4].pose,
      scene_.pose_text({motion_between({0, 0, 0}, truth->true_pose()), {}, motion_between({0, 2, 0}, {0.035, 2, 0})},
                       motion_between({0, 0, 0}, truth->true_pose()), place_.unit_m));
}

// Catches a late stamp that changes the header or the truth: the program must not see it.
TEST_F(CameraTimeTest, ALateStampChangesOnlyTheImages) {
  constexpr int kFrames = 9;
  struct Record {
    std::vector<std::string> poses;  // of all shutter samples
    std::vector<std::chrono::nanoseconds> captured;
    std::vector<Pose2> truths;
  };
  const auto run = [this](const CameraEffects& effects) {
    desk_->jobs.clear();
    desk_->done.clear();
    const auto world = simulation();
    const auto camera = streaming(*world, effects);
    const auto drive = world->open_drive();
    const auto truth = world->open_truth();
    Record record;
    for (int i = 0; i < kFrames; ++i) {
      record.captured.push_back(camera->grab(0ms)->header().captured.since_zero);
      record.truths.push_back(truth->true_pose());
      (void)drive->set_speeds({2, 2 + 0.1 * i});
    }
    for (const RenderJob& job : desk_->jobs) record.poses.push_back(job.pose);
    return record;
  };
  CameraEffects exposed{.exposure_time_s = 0.02, .readout_s = 0.04, .shutter_samples = 3};
  for (const auto& [in_time, shutter_samples] : {std::pair(CameraEffects{}, 1U), std::pair(exposed, 3U)}) {
    const Record wanted = run(in_time);
    ASSERT_EQ(wanted.poses.size(), kFrames * shutter_samples);
    for (const unsigned periods : {1U, 3U, 5U}) {
      CameraEffects effects = in_time;
      effects.stamp_late_s = 0.1 * periods;
      const Record late = run(effects);
      EXPECT_EQ(late.captured, wanted.captured);
      EXPECT_EQ(late.truths, wanted.truths);
      ASSERT_EQ(late.poses.size(), wanted.poses.size()) << "it requires no additional image";
      for (std::size_t i = 0; i < late.poses.size(); ++i) {
        const std::size_t behind = periods * shutter_samples;
        const std::string& there = i < behind ? wanted.poses.front() : wanted.poses[i - behind];
        EXPECT_EQ(late.poses[i], there) << "image " << i << ", " << periods << " periods late";
        if (i >= shutter_samples) {
          EXPECT_NE(late.poses[i], wanted.poses[i]);
        }
      }
    }
  }
}

TEST_F(CameraTimeTest, LostFramesAreCounted) {
  CameraEffects effects{.drop_probability = 0.3};
  const auto world = simulation();
  const auto camera = streaming(*world, effects);
  std::uint64_t next = 0;
  std::uint64_t lost = 0;
  for (int i = 0; i < 200; ++i) {
    const auto frame = value(camera->grab(0ms));
    ASSERT_EQ(frame.header().sequence, next + frame.header().lost_before);
    next = frame.header().sequence + 1;
    lost += frame.header().lost_before;
  }
  // Of about 286 images 86 are lost, with a standard deviation of 11.
  EXPECT_GT(lost, 40U);
  EXPECT_LT(lost, 140U);
  EXPECT_EQ(desk_->jobs.size(), 200U) << "lost frames are not rendered";
}

// Catches a late frame that shows a newer step than its time stamp, or that is lost.
TEST_F(CameraTimeTest, ALateFrameArrivesOnePeriodLater) {
  CameraEffects effects{.late_probability = 0.3};
  const auto world = simulation();
  const auto camera = streaming(*world, effects);
  const auto drive = world->open_drive();
  int late = 0;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const auto frame = value(camera->grab(0ms));
    ASSERT_EQ(frame.header().sequence, i);
    ASSERT_EQ(frame.header().lost_before, 0U);
    ASSERT_EQ(frame.header().captured.since_zero, 100ms * i);
    const auto behind = drive->read_angles()->time.since_zero - frame.header().captured.since_zero;
    ASSERT_TRUE(behind == 0ms || behind == 100ms) << behind.count();
    late += behind == 100ms ? 1 : 0;
  }
  EXPECT_GT(late, 10);
  EXPECT_LT(late, 60);
}

TEST_F(CameraTimeTest, AnExposureLongerThanAFrameIsRefused) {
  CameraEffects effects{.exposure_time_s = 0.08, .readout_s = 0.03};
  const auto world = simulation();
  const auto camera = value(world->open_camera({"lower", 1, effects}));
  EXPECT_THAT(camera->configure(kSmallSize),
              FailsWith(ErrorCode::kRefused, HasSubstr("exposure and readout take 0.11 s")));
}

}  // namespace
}  // namespace twocone::sim_povray
