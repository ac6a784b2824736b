// SPDX-License-Identifier: Apache-2.0
#include "hal/stereo_rig.h"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/hal/scripted_devices.h"
#include "tests/support/fails_with.h"

namespace twocone {
namespace {

using namespace std::chrono_literals;
using test::frame_at;
using test::ScriptedCamera;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using testing_support::FailsWith;

constexpr auto kMaxSkew = 5ms;
constexpr CameraSettings kSettings{64, 48, 20};

class StereoRigTest : public testing::Test, protected test::ScriptedPair {
 protected:
  void start() { ASSERT_TRUE(rig_.start(kSettings, kSettings)); }

  StereoRig rig_ = make_rig(kMaxSkew);
};

TEST_F(StereoRigTest, NeedsTwoCamerasAndABound) {
  const auto camera = [this] { return std::make_unique<ScriptedCamera>("camera", lower_, log_); };
  EXPECT_THROW(StereoRig(nullptr, camera(), 0ns), std::invalid_argument);
  EXPECT_THROW(StereoRig(camera(), nullptr, 0ns), std::invalid_argument);
  EXPECT_THROW(StereoRig(camera(), camera(), -1ns), std::invalid_argument);
}

TEST_F(StereoRigTest, PairsFramesOfOneMoment) {
  start();
  for (std::uint64_t i = 0; i < 3; ++i) {
    lower_->grabs.push_back(frame_at(i, i * 50ms));
    upper_->grabs.push_back(frame_at(i + 10, i * 50ms + 2ms));
  }
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto pair = rig_.grab(1s);
    ASSERT_TRUE(pair) << "pair " << i;
    EXPECT_EQ(pair->lower.header().sequence, i);
    EXPECT_EQ(pair->upper.header().sequence, i + 10);
    EXPECT_EQ(pair->skew(), 2ms);
  }
  EXPECT_EQ(rig_.unpaired(), 0U);
}

TEST_F(StereoRigTest, ASkewOfExactlyTheBoundPassesInEitherSense) {
  start();
  lower_->grabs = {frame_at(0, 10ms), frame_at(1, 60ms)};
  upper_->grabs = {frame_at(0, 15ms), frame_at(1, 55ms)};
  const auto later = rig_.grab(1s);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->skew(), 5ms);
  const auto earlier = rig_.grab(1s);
  ASSERT_TRUE(earlier);
  EXPECT_EQ(earlier->skew(), -5ms);
}

// Catches a rig that drops both frames of a bad pair, or the newer one, which would then never find its partner.
TEST_F(StereoRigTest, DropsTheOlderOfTwoThatDoNotBelongTogether) {
  start();
  lower_->grabs = {frame_at(0, 0ms), frame_at(1, 50ms)};
  upper_->grabs = {frame_at(1, 50ms)};
  auto pair = rig_.grab(1s);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->lower.header().sequence, 1U);
  EXPECT_EQ(pair->upper.header().sequence, 1U);
  EXPECT_EQ(rig_.unpaired(), 1U);

  lower_->grabs = {frame_at(4, 200ms)};
  upper_->grabs = {frame_at(2, 100ms), frame_at(3, 150ms), frame_at(4, 200ms)};
  pair = rig_.grab(1s);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->upper.header().sequence, 4U);
  EXPECT_EQ(rig_.unpaired(), 3U);
}

TEST_F(StereoRigTest, OneNanosecondPastTheBoundIsRefused) {
  start();
  lower_->grabs = {frame_at(0, 10ms)};
  upper_->grabs = {frame_at(0, 15ms + 1ns)};
  EXPECT_THAT(rig_.grab(0ms), FailsWith(ErrorCode::kTimeout, HasSubstr("5.000001 ms apart")));
  EXPECT_EQ(rig_.unpaired(), 1U);
}

// Catches an endless search if two cameras never agree (for example, if one of them runs at another rate).
TEST_F(StereoRigTest, GivesUpInTimeIfNoTwoFramesEverMatch) {
  start();
  constexpr std::uint64_t kMany = 50'000;  // more frames than two milliseconds suffice for
  for (std::uint64_t i = 0; i < kMany; ++i) {
    lower_->grabs.push_back(frame_at(i, i * 50ms));
    upper_->grabs.push_back(frame_at(i, i * 50ms + 25ms));
  }
  EXPECT_THAT(rig_.grab(2ms), FailsWith(ErrorCode::kTimeout, HasSubstr("25 ms apart")));
  EXPECT_FALSE(lower_->grabs.empty());
}

// Catches a rig that discards the lower frame when the upper one is late: at the next call the pair would be lost.
TEST_F(StereoRigTest, KeepsAFrameWhosePartnerIsLate) {
  start();
  lower_->grabs = {frame_at(0, 0ms), frame_at(1, 50ms)};
  EXPECT_THAT(rig_.grab(0ms), FailsWith(ErrorCode::kTimeout, StartsWith("upper: ")));

  upper_->grabs = {frame_at(0, 1ms)};
  const auto pair = rig_.grab(0ms);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->lower.header().sequence, 0U);
  EXPECT_EQ(rig_.unpaired(), 0U);
}

TEST_F(StereoRigTest, ErrorsKeepTheirCodeAndNameTheView) {
  start();
  lower_->grabs = {Error{ErrorCode::kDisconnected, "unplugged"}};
  EXPECT_THAT(rig_.grab(1s), FailsWith(ErrorCode::kDisconnected, "lower: unplugged"));

  lower_->grabs = {frame_at(0, 0ms)};
  upper_->grabs = {Error{ErrorCode::kBadData, "half a frame"}};
  EXPECT_THAT(rig_.grab(1s), FailsWith(ErrorCode::kBadData, "upper: half a frame"));
}

// Catches a rig that gives each camera the whole timeout, so that the caller waits twice as long.
TEST_F(StereoRigTest, BothCamerasShareOneTimeout) {
  start();
  lower_->grabs = {frame_at(0, 0ms)};
  upper_->grabs = {frame_at(0, 0ms)};
  ASSERT_TRUE(rig_.grab(400ms));
  ASSERT_EQ(lower_->timeouts.size(), 1U);
  ASSERT_EQ(upper_->timeouts.size(), 1U);
  EXPECT_LE(lower_->timeouts[0], 400ms);
  EXPECT_LE(upper_->timeouts[0], lower_->timeouts[0]);
}

TEST_F(StereoRigTest, GrabBeforeStartIsRefused) { EXPECT_THAT(rig_.grab(0ms), FailsWith(ErrorCode::kInvalidState)); }

// Catches a camera that is left streaming, which the next start would find busy.
TEST_F(StereoRigTest, AStartThatFailsHalfWayStopsTheFirst) {
  upper_->started = Error{ErrorCode::kUnavailable, "no such device"};
  EXPECT_THAT(rig_.start(kSettings, kSettings), FailsWith(ErrorCode::kUnavailable, "upper: no such device"));
  EXPECT_THAT(*log_, ElementsAre("lower.configure", "lower.start", "upper.configure", "upper.start", "lower.stop"));

  upper_->started = {};
  EXPECT_TRUE(rig_.start(kSettings, kSettings)) << "and it can be tried again";
}

TEST_F(StereoRigTest, AFirstCameraThatFailsLeavesTheSecondAlone) {
  lower_->configured = Error{ErrorCode::kDisconnected, "unplugged"};
  const auto started = rig_.start(kSettings, kSettings);
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().message, "lower: unplugged");
  EXPECT_THAT(*log_, ElementsAre("lower.configure"));
}

// Catches a rig that accepts images of another size: every number of the robot's `rig:` would be wrong.
TEST_F(StereoRigTest, RefusesACameraThatGivesAnotherSize) {
  upper_->smaller_by.width_px = 4;
  EXPECT_THAT(rig_.start(kSettings, kSettings),
              FailsWith(ErrorCode::kRefused,
                        "upper: the camera gives 60 x 48 pixels instead of 64 x 48; ask for a size that it has"));
  EXPECT_THAT(*log_, ElementsAre("lower.configure", "lower.start", "upper.configure", "lower.stop"));
}

// Catches a frame from before the stop that is paired with one from after it.
TEST_F(StereoRigTest, StopDiscardsAWaitingFrame) {
  start();
  lower_->grabs = {frame_at(0, 0ms)};
  ASSERT_FALSE(rig_.grab(0ms));
  rig_.stop();
  start();
  lower_->grabs = {frame_at(7, 350ms)};
  upper_->grabs = {frame_at(7, 350ms)};
  const auto pair = rig_.grab(0ms);
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->lower.header().sequence, 7U);
  EXPECT_EQ(rig_.unpaired(), 0U);
}

TEST_F(StereoRigTest, FramesOfTwoClocksAreABugOfTheRobot) {
  start();
  lower_->grabs = {frame_at(0, 0ms)};
  upper_->grabs = {Frame({0, {ClockKind::kSteady, 0ns}, 0}, test::small_image())};
  EXPECT_THROW((void)rig_.grab(0ms), std::invalid_argument);
}

}  // namespace
}  // namespace twocone
