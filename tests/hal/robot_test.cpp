// SPDX-License-Identifier: Apache-2.0
#include "hal/robot.h"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/hal/scripted_devices.h"

namespace twocone {
namespace {

using namespace std::chrono_literals;
using test::Log;
using test::ScriptedCamera;
using test::ScriptedDrive;
using testing::ElementsAre;

class FixedTruth final : public GroundTruth {
 public:
  [[nodiscard]] Pose2 true_pose() const override { return {1.5, -0.25, 0.75}; }
};

class RobotTest : public testing::Test {
 protected:
  StereoRig rig() {
    return {std::make_unique<ScriptedCamera>("lower", lower_, log_),
            std::make_unique<ScriptedCamera>("upper", upper_, log_), 0ns};
  }
  std::unique_ptr<Robot> robot(std::unique_ptr<GroundTruth> truth = nullptr) {
    return std::make_unique<Robot>(rig(), std::make_unique<ScriptedDrive>(drive_, log_), std::move(truth));
  }

  std::shared_ptr<Log> log_ = std::make_shared<Log>();
  std::shared_ptr<ScriptedCamera::Script> lower_ = std::make_shared<ScriptedCamera::Script>();
  std::shared_ptr<ScriptedCamera::Script> upper_ = std::make_shared<ScriptedCamera::Script>();
  std::shared_ptr<ScriptedDrive::Script> drive_ = std::make_shared<ScriptedDrive::Script>();
};

TEST_F(RobotTest, NeedsADrive) { EXPECT_THROW(Robot(rig(), nullptr, nullptr), std::invalid_argument); }

TEST_F(RobotTest, OffersTruthOnlyWhereThereIsOne) {
  EXPECT_EQ(robot()->true_pose(), std::nullopt);
  EXPECT_EQ(robot(std::make_unique<FixedTruth>())->true_pose(), (Pose2{1.5, -0.25, 0.75}));
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

TEST_F(RobotTest, StopsTheCamerasEvenIfTheWheelsCannotBeTold) {
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

}  // namespace
}  // namespace twocone
