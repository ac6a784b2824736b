// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/wheel_history.h"

#include <cmath>

#include <gtest/gtest.h>

namespace twocone::estimation {
namespace {

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
