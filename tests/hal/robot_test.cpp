// SPDX-License-Identifier: Apache-2.0
#include "hal/robot.h"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/hal/scripted_devices.h"
#include "tests/support/error_of.h"
#include "tests/support/fails_with.h"

namespace twocone {
namespace {

using namespace std::chrono_literals;
using test::ScriptedCamera;
using test::ScriptedDrive;
using testing::ElementsAre;
using testing::StartsWith;
using testing_support::FailsWith;

class FixedTruth final : public GroundTruth {
 public:
  [[nodiscard]] Pose2 true_pose() const override { return {1.5, -0.25, 0.75}; }
  [[nodiscard]] std::string contact() const override { return "landmark red"; }
};

class RobotTest : public testing::Test, protected test::ScriptedPair {
 protected:
  std::unique_ptr<Robot> robot(std::unique_ptr<GroundTruth> truth = nullptr, std::vector<NamedCamera> others = {}) {
    return std::make_unique<Robot>(make_rig(0ns), std::make_unique<ScriptedDrive>(drive_, log_), std::move(truth),
                                   std::move(others));
  }
  NamedCamera other(const std::string& name, const std::shared_ptr<ScriptedCamera::Script>& script) {
    return {name, std::make_unique<ScriptedCamera>(name, script, log_), {320, 240, 7.5}};
  }
  /// A robot with the cameras `front` and `back` in addition to its pair.
  std::unique_ptr<Robot> robot_with_two_more() {
    std::vector<NamedCamera> others;
    others.push_back(other("front", front_));
    others.push_back(other("back", back_));
    return robot(nullptr, std::move(others));
  }

  std::shared_ptr<ScriptedCamera::Script> front_ = std::make_shared<ScriptedCamera::Script>();
  std::shared_ptr<ScriptedCamera::Script> back_ = std::make_shared<ScriptedCamera::Script>();
  std::shared_ptr<ScriptedDrive::Script> drive_ = std::make_shared<ScriptedDrive::Script>();
};

TEST_F(RobotTest, NeedsADrive) { EXPECT_THROW(Robot(make_rig(0ns), nullptr, nullptr), std::invalid_argument); }

TEST_F(RobotTest, OffersTruthOnlyIfItHasOne) {
  EXPECT_EQ(robot()->true_pose(), std::nullopt);
  EXPECT_EQ(robot(std::make_unique<FixedTruth>())->true_pose(), (Pose2{1.5, -0.25, 0.75}));
}

TEST_F(RobotTest, ReportsContactOnlyIfItHasTruth) {
  EXPECT_EQ(robot()->contact(), "");
  EXPECT_EQ(robot(std::make_unique<FixedTruth>())->contact(), "landmark red");
}

TEST_F(RobotTest, StepsByPairs) {
  const auto bot = robot();
  ASSERT_TRUE(bot->start({}, {}));
  lower_->grabs = {test::frame_at(3, 50ms)};
  upper_->grabs = {test::frame_at(3, 50ms)};
  const auto pair = bot->next_frame(1s);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->lower.header().sequence, 3U);
  EXPECT_EQ(bot->next_frame(0ms).error().code, ErrorCode::kTimeout);
}

// Catches stopping the cameras first: a camera that hangs while it stops would leave the robot driving.
TEST_F(RobotTest, StopsTheWheelsBeforeTheCameras) {
  const auto bot = robot();
  ASSERT_TRUE(bot->start({}, {}));
  log_->clear();
  bot->stop();
  EXPECT_THAT(*log_, ElementsAre("drive.stop", "lower.stop", "upper.stop"));
}

TEST_F(RobotTest, StopsTheCamerasEvenIfTheDriveIsDisconnected) {
  const auto bot = robot();
  ASSERT_TRUE(bot->start({}, {}));
  drive_->answer = Error{ErrorCode::kDisconnected, "unplugged"};
  log_->clear();
  bot->stop();
  EXPECT_THAT(*log_, ElementsAre("drive.stop", "lower.stop", "upper.stop"));
}

TEST_F(RobotTest, StopsWhenDestroyedTheWheelsFirst) {
  auto bot = robot();
  ASSERT_TRUE(bot->start({}, {}));
  log_->clear();
  bot.reset();
  EXPECT_THAT(*log_, ElementsAre("drive.stop", "lower.stop", "upper.stop", "drive.gone"));
}

// Catches a moved-from robot whose destructor touches the devices that it no longer has.
TEST_F(RobotTest, MovesWithoutStopping) {
  auto bot = robot();
  ASSERT_TRUE(bot->start({}, {}));
  log_->clear();
  {
    Robot moved = std::move(*bot);
    bot.reset();
    EXPECT_TRUE(log_->empty());
    ASSERT_TRUE(moved.drive().set_speeds({1, 1}));
  }
  EXPECT_THAT(*log_, ElementsAre("drive.set_speeds", "drive.stop", "lower.stop", "upper.stop", "drive.gone"));
}

TEST_F(RobotTest, RefusesOtherCamerasThatAreMissingOrShareANameNamingAll) {
  std::vector<NamedCamera> others;
  others.push_back({"front", nullptr, {}});
  others.push_back(other("", front_));
  others.push_back(other("lower", front_));
  others.push_back(other("back", front_));
  others.push_back(other("back", front_));
  EXPECT_EQ(testing_support::error_of<std::invalid_argument>([&] { robot(nullptr, std::move(others)); }),
            "Robot: camera 0 ('front') is missing; camera 1 has no name; the name 'lower' of camera 2 is taken; the "
            "name 'back' of camera 4 is taken;");
}

TEST_F(RobotTest, StartsTheOthersAfterThePairAndStopsThemLast) {
  const auto bot = robot_with_two_more();
  ASSERT_TRUE(bot->start({}, {}));
  EXPECT_THAT(*log_, ElementsAre("lower.configure", "lower.start", "upper.configure", "upper.start", "front.configure",
                                 "front.start", "back.configure", "back.start"));
  log_->clear();
  bot->stop();
  EXPECT_THAT(*log_, ElementsAre("drive.stop", "lower.stop", "upper.stop", "front.stop", "back.stop"));
}

// Catches a camera that streams on although its robot did not start.
TEST_F(RobotTest, LeavesNoCameraRunningIfOneDoesNotStart) {
  back_->started = Error{ErrorCode::kUnavailable, "no such device"};
  const auto bot = robot_with_two_more();
  EXPECT_THAT(bot->start({}, {}), FailsWith(ErrorCode::kUnavailable, "back: no such device"));
  log_->clear();
  (void)bot->next_frame(0ms);
  EXPECT_THAT(*log_, ElementsAre()) << "a camera was grabbed that should be stopped";
}

TEST_F(RobotTest, RefusesAnotherCameraOfAnotherSize) {
  front_->smaller_by = {0, 40, 0};
  const auto started = robot_with_two_more()->start({}, {});
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().message,
            "front: the camera gives 320 x 200 pixels instead of 320 x 240; ask for a size that it has");
}

TEST_F(RobotTest, OffersTheOthersFramesOfTheNewestPair) {
  const auto bot = robot_with_two_more();
  EXPECT_TRUE(bot->other_frames().empty());
  ASSERT_TRUE(bot->start({}, {}));
  EXPECT_TRUE(bot->other_frames().empty());
  for (const std::uint64_t n : {4U, 5U}) {
    for (const auto& camera : {lower_, upper_}) camera->grabs.push_back(test::frame_at(n, 50ms));
    front_->grabs.push_back(test::frame_at(10 + n, 50ms));
    back_->grabs.push_back(test::frame_at(20 + n, 50ms));
  }
  log_->clear();
  ASSERT_TRUE(bot->next_frame(1s));
  EXPECT_THAT(*log_, ElementsAre("lower.grab", "upper.grab", "front.grab", "back.grab"));
  ASSERT_TRUE(bot->next_frame(1s));
  ASSERT_EQ(bot->other_frames().size(), 2U);
  EXPECT_EQ(bot->other_frames()[0].name, "front");
  EXPECT_EQ(bot->other_frames()[0].frame.header().sequence, 15U);
  EXPECT_EQ(bot->other_frames()[1].name, "back");
  EXPECT_EQ(bot->other_frames()[1].frame.header().sequence, 25U);
}

// Catches a retry that grabs the pair again: in simulation that steps the world, on hardware it loses a pair.
TEST_F(RobotTest, KeepsThePairUntilTheOthersHaveArrived) {
  const auto bot = robot_with_two_more();
  ASSERT_TRUE(bot->start({}, {}));
  for (const auto& camera : {lower_, upper_}) camera->grabs = {test::frame_at(3, 50ms), test::frame_at(4, 60ms)};
  front_->grabs = {test::frame_at(13, 50ms)};
  EXPECT_THAT(bot->next_frame(1s), FailsWith(ErrorCode::kTimeout, StartsWith("back: ")));
  EXPECT_TRUE(bot->other_frames().empty()) << "half of the frames of a step were returned";

  back_->grabs = {test::frame_at(23, 50ms)};
  const auto pair = bot->next_frame(1s);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->lower.header().sequence, 3U);
  ASSERT_EQ(bot->other_frames().size(), 2U);
  EXPECT_EQ(bot->other_frames()[0].frame.header().sequence, 13U);
}

// Catches a separate timeout for each camera: five cameras would wait five times as long.
TEST_F(RobotTest, WaitsForAllCamerasTogetherNoLongerThanTheTimeout) {
  const auto bot = robot_with_two_more();
  ASSERT_TRUE(bot->start({}, {}));
  lower_->grabs = {test::frame_at(3, 50ms)};
  upper_->grabs = {test::frame_at(3, 50ms)};
  front_->grabs = {test::frame_at(3, 50ms)};
  back_->grabs = {test::frame_at(3, 50ms)};
  ASSERT_TRUE(bot->next_frame(1s));
  for (const auto& camera : {front_, back_}) {
    ASSERT_EQ(camera->timeouts.size(), 1U);
    EXPECT_LT(camera->timeouts[0], 1s) << "time has passed since the call began";
    EXPECT_GT(camera->timeouts[0], 0s);
  }
}

// Catches a frame from before a stop that is returned after the next start.
TEST_F(RobotTest, DiscardsAnIncompleteStepWhenItStops) {
  const auto bot = robot_with_two_more();
  ASSERT_TRUE(bot->start({}, {}));
  lower_->grabs = {test::frame_at(3, 50ms)};
  upper_->grabs = {test::frame_at(3, 50ms)};
  ASSERT_FALSE(bot->next_frame(1s));
  bot->stop();
  ASSERT_TRUE(bot->start({}, {}));
  for (const auto& camera : {lower_, upper_, front_, back_}) camera->grabs = {test::frame_at(8, 90ms)};
  const auto pair = bot->next_frame(1s);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->lower.header().sequence, 8U);
}

}  // namespace
}  // namespace twocone
