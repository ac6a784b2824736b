// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/track.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace twocone::estimation {
namespace {

using namespace std::chrono_literals;

Timestamp at(std::chrono::nanoseconds time) { return {ClockKind::kSteady, time}; }

TEST(WheelHistory, InterpolatesBetweenTwoReadings) {
  estimation::WheelHistory history;
  history.add({at(1000ms), 1, -1});
  history.add({at(1040ms), 2, -3});
  history.add({at(1080ms), 2, -3});
  const WheelAngles between = history.at(at(1010ms));
  EXPECT_EQ(between.time, at(1010ms));
  EXPECT_DOUBLE_EQ(between.left_rad, 1.25);
  EXPECT_DOUBLE_EQ(between.right_rad, -1.5);
  EXPECT_EQ(history.at(at(1060ms)).left_rad, 2);
  EXPECT_EQ(history.at(at(1040ms)).right_rad, -3);
}

// Readings of a simulation are from the step of the frame. The result equals the reading to the last bit.
TEST(WheelHistory, IsTheReadingItselfAtItsTimeAndBeyond) {
  estimation::WheelHistory history;
  history.add({at(10ms), 0.1, 0.2});
  EXPECT_EQ(history.at(at(10ms)).left_rad, 0.1);
  EXPECT_EQ(history.at(at(0ms)).left_rad, 0.1) << "there is no earlier reading";
  history.add({at(20ms), 0.3, 0.4});
  EXPECT_EQ(history.at(at(20ms)).left_rad, 0.3);
  EXPECT_EQ(history.at(at(25ms)).right_rad, 0.4) << "there is no later reading, and no extrapolation";
}

TEST(WheelHistory, ForgetsWhatNoFrameCanBeOf) {
  estimation::WheelHistory history;
  for (int i = 0; i <= 600; ++i) history.add({at(i * 100ms), double(i), 0});
  EXPECT_DOUBLE_EQ(history.at(at(56s)).left_rad, 560);
  EXPECT_GE(history.at(at(0s)).left_rad, 549);
}

TEST(WheelHistory, RefusesATimeOfAnotherClock) {
  estimation::WheelHistory history;
  history.add({at(10ms), 0.1, 0.2});
  EXPECT_THROW((void)history.at({ClockKind::kSimulated, 10ms}), std::invalid_argument);
}

TEST(BelievedPose, IsTheOdometryUntilAFixComes) {
  estimation::BelievedPose belief;
  belief.add_odometry(0, {1, 2, 0.3});
  EXPECT_EQ(belief.pose(), (localisation::Pose{1, 2, 0.3}));
}

TEST(BelievedPose, LateFixesCorrectByTheDifferenceAtTheirOwnFrame) {
  // The odometry has a constant error of (0.5, -0.2). Fixes arrive four frames late.
  estimation::BelievedPose belief;
  for (std::uint64_t frame = 0; frame < 60; ++frame) {
    const double x = 0.1 * double(frame);
    belief.add_odometry(frame, {x + 0.5, -0.2, 0.7});
    if (frame >= 4) belief.add_fix(frame - 4, {0.1 * double(frame - 4), 0});
  }
  // 56 corrections by a fifth each leave 0.8^56 of the error.
  const double left_m = 0.5 * std::pow(1 - estimation::BelievedPose::kShare, 56) * 1.01;
  EXPECT_NEAR(belief.pose().x_m, 5.9, left_m);
  EXPECT_NEAR(belief.pose().y_m, 0, left_m);
  EXPECT_EQ(belief.pose().heading_rad, 0.7);
}

TEST(BelievedPose, FramesWithoutAFixAreLeftBehind) {
  estimation::BelievedPose belief;
  for (std::uint64_t frame = 0; frame < 10; ++frame) belief.add_odometry(frame, {double(frame), 0, 0});
  belief.add_fix(7, {8, 0});
  EXPECT_DOUBLE_EQ(belief.pose().x_m, 9 + estimation::BelievedPose::kShare);
}

}  // namespace
}  // namespace twocone::estimation
