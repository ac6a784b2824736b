// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/start_check.h"

#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::runs {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

config::Robot robot() {
  config::Robot robot;
  robot.start = Pose2{.x_m = 0.7, .y_m = -0.4, .heading_rad = 30 * kDegree};
  robot.body_radius_m = 0.2;
  robot.rig.lower.azimuth_rad = -50 * kDegree;
  return robot;
}

/// A camera so far from the start, in x and in heading.
sim_povray::ShownCamera shown(double off_m, double turn_deg) {
  return {0.7 + off_m, -0.4, (30 - 50 + turn_deg) * kDegree};
}

TEST(StartCheck, WhatAgreesIsNoWord) {
  for (const auto& camera : {shown(0, 0), shown(0.0199, 1.99), shown(-0.0199, -1.99), shown(0, 360)}) {
    const auto told = compare_start(robot(), camera, "r.yaml:3");
    ASSERT_TRUE(told);
    EXPECT_EQ(*told, std::nullopt) << **told;
  }
}

TEST(StartCheck, FromTwentyMillimetresOrTwoDegreesBothPlacesAreTold) {
  auto told = compare_start(robot(), shown(0.021, 0), "r.yaml:3");
  ASSERT_TRUE(told && *told);
  EXPECT_EQ(**told,
            "r.yaml:3: start is (0.700, -0.400) m, heading 30.00 degrees, but the scene shows the robot at (0.721, "
            "-0.400) m, heading 30.00 degrees: 21 mm and 0.0 degrees apart");
  told = compare_start(robot(), shown(0, -2.1), "r.yaml:3");
  ASSERT_TRUE(told && *told);
  EXPECT_THAT(**told, HasSubstr("0 mm and 2.1 degrees apart"));
  told = compare_start(robot(), shown(0.199, 0), "r.yaml:3");
  EXPECT_TRUE(told) << "within the body";
}

TEST(StartCheck, BeyondTheBodyIsAnError) {
  const auto told = compare_start(robot(), shown(-1.0, 0), "r.yaml:3");
  ASSERT_FALSE(told);
  EXPECT_EQ(told.error().code, ErrorCode::kRefused);
  EXPECT_THAT(told.error().message, AllOf(HasSubstr("(0.700, -0.400) m"), HasSubstr("(-0.300, -0.400) m"),
                                          HasSubstr("more than body.radius_m of 0.2 m")));
}

TEST(StartCheck, AHeadingThatCannotBeReadOffIsSaid) {
  const auto told = compare_start(robot(), {0.75, -0.4, {}}, "r.yaml:3");
  ASSERT_TRUE(told && *told);
  EXPECT_THAT(**told, HasSubstr("its heading cannot be read off camera lower"));
}

}  // namespace
}  // namespace twocone::runs
