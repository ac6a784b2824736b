// SPDX-License-Identifier: Apache-2.0
// Several robots in one world, and what moves and is seen in it.
#include "drivers/sim_povray/hall.h"
#include "drivers/sim_povray/outline.h"

#include <atomic>
#include <future>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/simulation.h"
#include "tests/sim_povray/hand_renderer.h"

namespace twocone::sim_povray {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr const char* kScene =
    "union { //*PMName robot.1\n}\nunion { //*PMName robot.2\n}\nunion { //*PMName moving.trolley\n}\n"
    "camera { //*PMName lower.1\n}\ncamera { //*PMName lower.2\n}\n";
constexpr auto kLong = 10s;
constexpr auto kShort = 50ms;
constexpr CameraSettings kSize{64, 48, 10};

Seat::SteadyTime in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

class HallTest : public testing::Test {
 protected:
  HallTest() {
    place_.scene = "hall.pov";
    place_.moving = {{"trolley", {{0, 2}, {1, 2}}, 0.5, true, 0.1}};
    desk_->at_once = true;
    auto hall = Hall::open(place_, scene_, std::make_unique<HandRenderer>(desk_));
    if (!hall) throw std::runtime_error(hall.error().message);
    hall_ = *std::move(hall);
  }

  SeatSettings settings(const std::string& name, double x_m) {
    SeatSettings result;
    result.name = name;
    result.body.start = {x_m, 0, 0};
    result.body.radius_m = 0.2;
    return result;
  }
  std::unique_ptr<Seat> seated(const std::string& name, double x_m) {
    auto seat = hall_->take_seat(settings(name, x_m));
    if (!seat) throw std::runtime_error(seat.error().message);
    return *std::move(seat);
  }
  static void configure(Seat& seat) {
    const auto view = seat.open_view({"lower", 1, {}});
    if (!view) throw std::runtime_error(view.error().message);
    if (auto done = seat.configure_view(*view, kSize); !done) throw std::runtime_error(done.error().message);
  }
  std::string refusal(const SeatSettings& wanted) {
    const auto seat = hall_->take_seat(wanted);
    return seat ? "taken" : seat.error().message;
  }

  const Scene scene_ = *Scene::parse(kScene, "hall.pov");
  PlaceSettings place_;
  std::shared_ptr<HandRenderer::Desk> desk_ = std::make_shared<HandRenderer::Desk>();
  std::shared_ptr<Hall> hall_;
};

TEST_F(HallTest, ARobotIsClaimedOnceAndByItsName) {
  const auto one = seated("1", 0);
  EXPECT_EQ(refusal(settings("1", 0)), "robot.1 is taken by another program");
  EXPECT_THAT(refusal(settings("3", 0)), HasSubstr("no object 'robot.3' for the robot '3'; the scene's robots are: "
                                                   "robot.1, robot.2"));
  EXPECT_EQ(refusal(settings("2", 0.3)), "start of robot.2 touches robot.1");
  SeatSettings placed = settings("2", 0.3);
  placed.body.start_place = "robots/two.yaml:17";
  auto refused = hall_->take_seat(placed);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "robots/two.yaml:17: start of robot.2 touches robot.1");
  EXPECT_EQ(refusal(settings("2", 0.5)), "taken");
}

// Catches a robot that believes in another world than the one it is in: its ranges would be off by as much.
TEST_F(HallTest, ARobotWithAnotherMapIsRefusedAndTheDifferenceNamed) {
  SeatSettings other = settings("1", 0);
  PlaceSettings believed = place_;
  believed.moving[0].path_m[1].x_m = 1.649;
  other.map_outline = outline_of(believed);
  const auto refused = hall_->take_seat(other);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message,
              testing::AllOf(HasSubstr("the robot's map is not that of this world: the map has moving trolley"),
                             HasSubstr("(1.649, 2.000)"), HasSubstr("; the world has moving trolley")));
  other.map_outline = outline_of(place_);
  EXPECT_TRUE(hall_->take_seat(other));
}

// Catches a world that goes on without somebody, or that steps twice.
TEST_F(HallTest, TheWorldStepsOnceWhenAllHaveAsked) {
  const auto one = seated("1", 0);
  const auto two = seated("2", 1);
  configure(*one);
  configure(*two);
  const auto alone = one->step(in(kShort));
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(alone.error().message, "the world waits for robot.2");
  EXPECT_EQ(one->state().tick, 0U);
  for (std::uint64_t tick = 1; tick <= 20; ++tick) {
    auto other = std::async(std::launch::async, [&] { return two->step(in(kLong)); });
    const auto stepped = one->step(in(kLong));
    ASSERT_TRUE(stepped) << stepped.error().message;
    ASSERT_TRUE(other.get());
    ASSERT_EQ(one->state().tick, tick);
    ASSERT_EQ(two->state().tick, tick);
    ASSERT_EQ(one->state().now, 100ms * tick);
  }
}

// Catches a program that asks for the next instant of a world without a rate: it would take a served world down.
TEST_F(HallTest, WithoutAConfiguredCameraThereIsNoStep) {
  const auto one = seated("1", 0);
  const auto stepped = one->step(in(kShort));
  ASSERT_FALSE(stepped);
  EXPECT_EQ(stepped.error().code, ErrorCode::kInvalidState);
  configure(*one);
  EXPECT_TRUE(one->step(in(kShort)));
}

TEST_F(HallTest, WhoLeavesIsNotWaitedForAndStands) {
  const auto one = seated("1", 0);
  auto two = seated("2", 1);
  configure(*one);
  configure(*two);
  (void)two->command({3, 3});
  auto waiting = std::async(std::launch::async, [&] { return one->step(in(kLong)); });
  std::this_thread::sleep_for(kShort);
  two.reset();
  ASSERT_TRUE(waiting.get()) << "the leaver's asking is not needed any more";
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(one->step(in(kLong)));
  // It stands where it was left, and can be claimed anew: from its start.
  EXPECT_EQ(seated("2", 1.5)->state().pose, (Pose2{1.5, 0, 0}));
}

TEST_F(HallTest, AnEmptyWorldBeginsAnew) {
  auto one = seated("1", 0);
  configure(*one);
  (void)one->command({3, 3});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(one->step(in(kLong)));
  EXPECT_NE(one->state().pose, (Pose2{0, 0, 0}));
  one.reset();
  one = seated("1", 0);
  EXPECT_EQ(one->state().tick, 0U);
  EXPECT_EQ(one->state().now, 0ns);
  EXPECT_EQ(one->state().pose, (Pose2{0, 0, 0}));
  EXPECT_EQ(one->state().left_rad, 0);
}

// Catches pictures in which only the one who looks has moved.
TEST_F(HallTest, EveryPictureShowsAllThatMoves) {
  const auto one = seated("1", 0);
  const auto two = seated("2", 1);
  configure(*one);
  configure(*two);
  (void)one->command({2, 2});
  (void)two->command({-4, -4});
  auto other = std::async(std::launch::async, [&] { return two->step(in(kLong)); });
  ASSERT_TRUE(one->step(in(kLong)));
  ASSERT_TRUE(other.get());
  (void)one->picture(0);
  (void)two->picture(0);
  const FloorMotion first = motion_between({0, 0, 0}, one->state().pose);
  const FloorMotion second = motion_between({1, 0, 0}, two->state().pose);
  const FloorMotion trolley = motion_between({0, 2, 0}, {0.05, 2, 0});
  EXPECT_GT(first.x_m, 0);
  EXPECT_LT(second.x_m, 0);
  ASSERT_EQ(desk_->jobs.size(), 2U);
  EXPECT_EQ(desk_->jobs[0].pose, scene_.pose_text({first, second, trolley}, first, place_.unit_m));
  EXPECT_EQ(desk_->jobs[1].pose, scene_.pose_text({first, second, trolley}, second, place_.unit_m));
}

// Catches a late stamp that holds for the robot alone: others and things would be seen where they were not.
TEST_F(HallTest, ALateStampShowsAllThatMovesAtTheEarlierTime) {
  const auto one = seated("1", 0);
  const auto two = seated("2", 1);
  CameraEffects effects;
  effects.stamp_late_s = 0.1;
  ASSERT_TRUE(one->open_view({"lower", 1, effects}));
  ASSERT_TRUE(one->configure_view(0, kSize));
  configure(*two);
  const auto step = [&] {
    (void)one->command({2, 3});
    (void)two->command({-4, -3});
    auto other = std::async(std::launch::async, [&] { return two->step(in(kLong)); });
    ASSERT_TRUE(one->step(in(kLong)));
    ASSERT_TRUE(other.get());
  };
  step();
  const FloorMotion first = motion_between({0, 0, 0}, one->state().pose);
  const FloorMotion second = motion_between({1, 0, 0}, two->state().pose);
  step();
  EXPECT_GT(one->state().pose.x_m, first.x_m);
  (void)one->picture(0);
  ASSERT_EQ(desk_->jobs.size(), 1U);
  EXPECT_EQ(desk_->jobs[0].pose,
            scene_.pose_text({first, second, motion_between({0, 2, 0}, {0.05, 2, 0})}, first, place_.unit_m));
}

TEST_F(HallTest, AMovingThingMustBeInTheScene) {
  place_.moving[0].name = "cart";
  const auto hall = Hall::open(place_, scene_, std::make_unique<HandRenderer>(desk_));
  ASSERT_FALSE(hall);
  EXPECT_THAT(hall.error().message, HasSubstr("hall.pov: no object 'moving.cart'"));
}

// ---- cameras that take time, lose frames or are late

class CameraTimeTest : public HallTest {
 protected:
  std::unique_ptr<Simulation> simulation(const std::string& name = "1") {
    auto wanted = settings(name, 0);
    wanted.body.seed = 7;
    wanted.run_ahead_frames = 1000;
    auto seat = hall_->take_seat(wanted);
    if (!seat) throw std::runtime_error(seat.error().message);
    return make_simulation(*std::move(seat), wanted);
  }
  static std::unique_ptr<Camera> streaming(Simulation& simulation, const CameraEffects& effects) {
    auto camera = simulation.open_camera({"lower", 1, effects});
    if (!camera) throw std::runtime_error(camera.error().message);
    if (auto done = (*camera)->configure(kSize); !done) throw std::runtime_error(done.error().message);
    if (auto done = (*camera)->start(); !done) throw std::runtime_error(done.error().message);
    return *std::move(camera);
  }
};

// Catches a time stamp at the end of the exposure, and a truth of another moment than the picture.
TEST_F(CameraTimeTest, AnExposureIsStampedInItsMiddle) {
  CameraEffects effects;
  effects.exposure_s = 0.02;
  effects.readout_s = 0.04;
  effects.exposures = 3;
  const auto world = simulation();
  const auto camera = streaming(*world, effects);
  const auto drive = world->open_drive();
  const auto truth = world->open_truth();
  (void)camera->grab(0ms);
  (void)drive->set_speeds({2, 2});
  const auto frame = camera->grab(0ms);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->header().captured.since_zero, 70ms);
  // 2 rad/s on wheels of 0.05 m, for 70 ms.
  EXPECT_NEAR(truth->true_pose().x_m, 0.007, 1e-12);
  ASSERT_EQ(desk_->jobs.size(), 6U);
  EXPECT_EQ(desk_->jobs[0].pose, desk_->jobs[2].pose) << "before the beginning everything stands";
  // Thirds of the 60 ms that end at 100 ms: their middles are at 50, 70 and 90 ms.
  EXPECT_EQ(
      desk_->jobs[4].pose,
      scene_.pose_text({motion_between({0, 0, 0}, truth->true_pose()), {}, motion_between({0, 2, 0}, {0.035, 2, 0})},
                       motion_between({0, 0, 0}, truth->true_pose()), place_.unit_m));
}

// Catches a late stamp that shows in the header or in the truth: the program must not be told.
TEST_F(CameraTimeTest, ALateStampIsSeenInThePicturesAlone) {
  constexpr int kFrames = 9;
  struct Told {
    std::vector<std::string> poses;  // of all exposures
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
    Told told;
    for (int i = 0; i < kFrames; ++i) {
      told.captured.push_back(camera->grab(0ms)->header().captured.since_zero);
      told.truths.push_back(truth->true_pose());
      (void)drive->set_speeds({2, 2 + 0.1 * i});
    }
    for (const RenderJob& job : desk_->jobs) told.poses.push_back(job.pose);
    return told;
  };
  CameraEffects exposed;
  exposed.exposure_s = 0.02;
  exposed.readout_s = 0.04;
  exposed.exposures = 3;
  for (const auto& [in_time, exposures] : {std::pair(CameraEffects{}, 1U), std::pair(exposed, 3U)}) {
    const Told wanted = run(in_time);
    ASSERT_EQ(wanted.poses.size(), kFrames * exposures);
    for (const unsigned periods : {1U, 3U, 5U}) {
      CameraEffects effects = in_time;
      effects.stamp_late_s = 0.1 * periods;
      const Told late = run(effects);
      EXPECT_EQ(late.captured, wanted.captured);
      EXPECT_EQ(late.truths, wanted.truths);
      ASSERT_EQ(late.poses.size(), wanted.poses.size()) << "it costs no picture";
      for (std::size_t i = 0; i < late.poses.size(); ++i) {
        const std::size_t behind = periods * exposures;
        const std::string& there = i < behind ? wanted.poses.front() : wanted.poses[i - behind];
        EXPECT_EQ(late.poses[i], there) << "picture " << i << ", " << periods << " periods late";
        if (i >= exposures) {
          EXPECT_NE(late.poses[i], wanted.poses[i]);
        }
      }
    }
  }
}

TEST_F(CameraTimeTest, LostFramesAreCounted) {
  CameraEffects effects;
  effects.drop_probability = 0.3;
  const auto world = simulation();
  const auto camera = streaming(*world, effects);
  std::uint64_t next = 0;
  std::uint64_t lost = 0;
  for (int i = 0; i < 200; ++i) {
    const auto frame = camera->grab(0ms);
    ASSERT_TRUE(frame) << frame.error().message;
    ASSERT_EQ(frame->header().sequence, next + frame->header().lost_before);
    next = frame->header().sequence + 1;
    lost += frame->header().lost_before;
  }
  // Of about 286 drawn, 86 are lost, with a standard deviation of 11.
  EXPECT_GT(lost, 40U);
  EXPECT_LT(lost, 140U);
  EXPECT_EQ(desk_->jobs.size(), 200U) << "what is lost is not rendered";
}

// Catches a late frame that shows a newer instant than its time stamp says, or that is lost.
TEST_F(CameraTimeTest, ALateFrameComesOnePeriodLater) {
  CameraEffects effects;
  effects.late_probability = 0.3;
  const auto world = simulation();
  const auto camera = streaming(*world, effects);
  const auto drive = world->open_drive();
  int late = 0;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const auto frame = camera->grab(0ms);
    ASSERT_TRUE(frame) << frame.error().message;
    ASSERT_EQ(frame->header().sequence, i);
    ASSERT_EQ(frame->header().lost_before, 0U);
    ASSERT_EQ(frame->header().captured.since_zero, 100ms * i);
    const auto behind = drive->read_angles()->time.since_zero - frame->header().captured.since_zero;
    ASSERT_TRUE(behind == 0ms || behind == 100ms) << behind.count();
    late += behind == 100ms ? 1 : 0;
  }
  EXPECT_GT(late, 10);
  EXPECT_LT(late, 60);
}

TEST_F(CameraTimeTest, AnExposureLongerThanAFrameIsRefused) {
  CameraEffects effects;
  effects.exposure_s = 0.08;
  effects.readout_s = 0.03;
  const auto world = simulation();
  const auto camera = world->open_camera({"lower", 1, effects});
  ASSERT_TRUE(camera);
  const auto configured = (*camera)->configure(kSize);
  ASSERT_FALSE(configured);
  EXPECT_THAT(configured.error().message, HasSubstr("exposure and readout take 0.11 s"));
}

}  // namespace
}  // namespace twocone::sim_povray
