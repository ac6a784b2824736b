// SPDX-License-Identifier: Apache-2.0
// A pair of real cameras, which run freely, are lost and come back.
#include <algorithm>
#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hal/stereo_rig.h"
#include "tests/hal/scripted_devices.h"
#include "tests/support/fails_with.h"

namespace twocone {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using std::chrono::steady_clock;
using test::frame_at;
using test::ScriptedCamera;
using testing::HasSubstr;
using testing_support::FailsWith;

constexpr CameraSettings kHardwareSettings{64, 48, 25};
constexpr auto kPeriod = 40ms;

class HardwareRigTest : public testing::Test, protected test::ScriptedPair {
 protected:
  void start() { ASSERT_TRUE(rig_.start(kHardwareSettings, kHardwareSettings)); }
  void unplug(ScriptedCamera::Script& camera) {
    camera.grabs.push_back(Error{ErrorCode::kDisconnected, "unplugged"});
    camera.configured = Error{ErrorCode::kDisconnected, "no such file"};
  }
  [[nodiscard]] std::ptrdiff_t asked(const std::string& what) const {
    return std::count(log_->begin(), log_->end(), what);
  }

  StereoRig rig_ = make_rig(20ms);
};

TEST_F(HardwareRigTest, ALostCameraIsStartedAgain) {
  for (auto* const camera : {lower_.get(), upper_.get()}) {
    SCOPED_TRACE(camera == lower_.get() ? "lower" : "upper");
    rig_.stop();
    start();
    const auto recoveries = rig_.recoveries();
    const auto unpaired = rig_.unpaired();
    auto& other = camera == lower_.get() ? *upper_ : *lower_;
    other.grabs = {frame_at(0, 0ms)};
    unplug(*camera);
    auto pair = rig_.grab(1s);
    ASSERT_THAT(pair, FailsWith(ErrorCode::kDisconnected, HasSubstr("unplugged")));

    // While the camera is lost, each call takes and drops one frame of the other camera.
    for (std::uint64_t i = 1; i <= 4; ++i) other.grabs.push_back(frame_at(i, std::int64_t(i) * kPeriod));
    while (!other.grabs.empty()) {
      pair = rig_.grab(1s);
      EXPECT_THAT(pair, FailsWith(ErrorCode::kDisconnected));
    }
    EXPECT_EQ(rig_.recoveries(), recoveries);

    camera->configured = {};
    other.grabs.push_back(frame_at(10, 10 * kPeriod));
    camera->grabs = {frame_at(0, 10 * kPeriod + 3ms)};
    do {
      pair = rig_.grab(1s);
    } while (!pair && pair.error().code == ErrorCode::kDisconnected);
    ASSERT_TRUE(pair) << pair.error().message;
    EXPECT_EQ(std::chrono::abs(pair->skew()), 3ms);
    EXPECT_EQ(rig_.recoveries(), recoveries + 1);
    EXPECT_EQ(rig_.unpaired(), unpaired + 5) << "all frames of the other camera from before";
  }
}

// Catches a rig that tries to open a missing device all the time, and one that waits too long between two tries.
TEST_F(HardwareRigTest, ItTriesAtMostFourTimesASecondAndNotMuchLess) {
  start();
  unplug(*lower_);
  ASSERT_FALSE(rig_.grab(1s));
  const auto tries_before = asked("lower.configure");
  const auto begin = steady_clock::now();
  int calls = 0;
  while (asked("lower.configure") - tries_before < 5) {
    EXPECT_FALSE(rig_.grab(1s));
    ASSERT_LT(++calls, 1000);
  }
  // Five tries have four pauses between them. A loaded machine makes the pauses longer, never shorter.
  EXPECT_GE(steady_clock::now() - begin, 1s - 1ms);
}

TEST_F(HardwareRigTest, AShortGrabDoesNotWaitForTheNextTry) {
  start();
  unplug(*lower_);
  ASSERT_FALSE(rig_.grab(1s));
  ASSERT_FALSE(rig_.grab(1s)) << "the first try is at once";
  const auto tries = asked("lower.configure");
  const auto begin = steady_clock::now();
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(rig_.grab(0ms), FailsWith(ErrorCode::kDisconnected));
  }
  if (steady_clock::now() - begin < 200ms) {
    EXPECT_EQ(asked("lower.configure"), tries);
  }
}

TEST_F(HardwareRigTest, BothCamerasMayBeLost) {
  start();
  unplug(*lower_);
  unplug(*upper_);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(rig_.grab(300ms).error().code, ErrorCode::kDisconnected);
  lower_->configured = upper_->configured = {};
  for (std::uint64_t i = 0; i < 3; ++i) {
    lower_->grabs.push_back(frame_at(i, std::int64_t(i) * kPeriod));
    upper_->grabs.push_back(frame_at(i, std::int64_t(i) * kPeriod));
  }
  auto pair = rig_.grab(1s);
  for (int i = 0; i < 10 && !pair; ++i) pair = rig_.grab(1s);
  ASSERT_TRUE(pair) << pair.error().message;
  EXPECT_EQ(rig_.recoveries(), 2U);
}

// Catches a rig calibration that is used for images of another size.
TEST_F(HardwareRigTest, ACameraThatComesBackWithAnotherSizeIsRefused) {
  start();
  unplug(*upper_);
  lower_->grabs = {frame_at(0, 0ms)};
  ASSERT_FALSE(rig_.grab(1s));
  upper_->configured = {};
  upper_->smaller_by.width_px = 4;
  EXPECT_THAT(rig_.grab(1s),
              FailsWith(ErrorCode::kRefused,
                        "upper: the camera gives 60 x 48 pixels instead of 64 x 48; ask for a size that it has"));
  EXPECT_EQ(rig_.recoveries(), 0U);
  EXPECT_EQ(asked("upper.start"), 1);
  upper_->smaller_by.width_px = 0;
  upper_->grabs = {frame_at(0, 0ms)};
  auto again = rig_.grab(1s);
  for (int i = 0; i < 10 && !again; ++i) again = rig_.grab(1s);
  EXPECT_TRUE(again) << again.error().message;
}

TEST_F(HardwareRigTest, AStartAfterALossIsNotARecovery) {
  start();
  unplug(*lower_);
  ASSERT_FALSE(rig_.grab(1s));
  lower_->configured = {};
  rig_.stop();
  start();
  lower_->grabs = {frame_at(0, 0ms)};
  upper_->grabs = {frame_at(0, 0ms)};
  EXPECT_TRUE(rig_.grab(1s));
  EXPECT_EQ(rig_.recoveries(), 0U) << "the rig itself did not recover the camera";
}

/// The pairs of two cameras that run freely, the upper one `behind` the lower.
class FreeRunningTest : public testing::TestWithParam<std::chrono::milliseconds>, protected test::ScriptedPair {};

// Catches a rig that takes the first pair within the limit: with a limit of a period or more, each frame would be
// paired with the one before its nearest.
TEST_P(FreeRunningTest, EachFrameIsPairedWithItsNearest) {
  constexpr int kFrames = 20;
  StereoRig rig = make_rig(1s);
  ASSERT_TRUE(rig.start(kHardwareSettings, kHardwareSettings));
  for (int i = 0; i < kFrames; ++i) {
    lower_->grabs.push_back(frame_at(std::uint64_t(i), i * nanoseconds(kPeriod)));
    upper_->grabs.push_back(frame_at(std::uint64_t(i), i * nanoseconds(kPeriod) + GetParam()));
  }
  int pairs = 0;
  // The limit is 0.6 periods, a tenth of a period above one half.
  while (auto pair = rig.grab(1s)) {
    ++pairs;
    EXPECT_LE(std::chrono::abs(pair->skew()), 24ms) << "pair " << pairs;
  }
  EXPECT_GE(pairs, kFrames - 1);
  EXPECT_LE(rig.unpaired(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Behind, FreeRunningTest, testing::Values(0ms, 13ms, 20ms, 23ms, 27ms, 33ms, 39ms),
                         [](const auto& tested) { return std::to_string(tested.param.count()) + "ms"; });

// Catches a rig that waits for the frame that is due by the reported rate: a camera may be slower in the dark.
TEST_F(HardwareRigTest, CamerasSlowerThanTheirReportedRateArePaired) {
  StereoRig rig = make_rig(100ms);
  ASSERT_TRUE(rig.start(kHardwareSettings, kHardwareSettings));
  lower_->grabs = {frame_at(0, 0ms), Error{ErrorCode::kTimeout, "none yet"}, frame_at(1, 200ms)};
  upper_->grabs = {frame_at(0, 90ms)};
  const auto pair = rig.grab(1s);
  ASSERT_TRUE(pair) << pair.error().message;
  EXPECT_EQ(pair->skew(), 90ms);
  EXPECT_LE(*std::max_element(lower_->timeouts.begin() + 1, lower_->timeouts.end()), kPeriod);
}

// A frame that was grabbed but is not the nearest one belongs to the next pair.
TEST_F(HardwareRigTest, AFrameThatIsNotNearerIsKeptForTheNextPair) {
  StereoRig rig = make_rig(100ms);
  ASSERT_TRUE(rig.start(kHardwareSettings, kHardwareSettings));
  lower_->grabs = {frame_at(0, 0ms), frame_at(1, 200ms)};
  upper_->grabs = {frame_at(0, 90ms), frame_at(1, 210ms)};
  EXPECT_EQ(rig.grab(1s)->skew(), 90ms);
  EXPECT_EQ(rig.grab(1s)->skew(), 10ms);
  EXPECT_EQ(rig.unpaired(), 0U);
}

}  // namespace
}  // namespace twocone
