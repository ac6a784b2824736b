// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/estimator.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace twocone::runs {
namespace {

files::Map map_of_three() {
  files::Map map;
  map.landmarks = {
      {"red", {1, 0, 0}, 2, 0, 0.1, 0.9}, {"green", {0, 1, 0}, 0, 2, 0.1, 0.9}, {"blue", {0, 0, 1}, -2, -1, 0.1, 0.9}};
  return map;
}

TEST(Method, IsNamedOrRefused) {
  EXPECT_EQ(method_named("paper"), Method::kPaper);
  EXPECT_EQ(to_string(Method::kPaper), "paper");
  try {
    (void)method_named("full");
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "method 'full' is not in this version; there is: paper");
  }
}

TEST(ToRows, JudgesAgainstTheTruthAndLeavesTheRestEmpty) {
  FrameAnswer answer;
  answer.ranges.resize(3);
  answer.ranges[0].verdict = vision::RangeVerdict::kOk;
  answer.ranges[0].range_m = 1.7;
  answer.ranges[1].verdict = vision::RangeVerdict::kTruncated;
  answer.fix.verdict = localisation::FixVerdict::kGap;
  answer.fix.position_m = Eigen::Vector2d(0.3, 0.4);
  const PoseRow truth{1, 0, 0, 0};
  const PoseRow odometry{1, 0.1, 0.1, 0.25};
  const AnswerRows rows = to_rows(5, 1.0, answer, map_of_three(), &truth, odometry);
  ASSERT_EQ(rows.ranges.size(), 3U);
  EXPECT_EQ(rows.ranges[0].range_m, 1.7);
  EXPECT_EQ(rows.ranges[0].true_range_m, 2);
  EXPECT_EQ(rows.ranges[1].verdict, "truncated");
  EXPECT_FALSE(rows.ranges[1].range_m);
  EXPECT_EQ(rows.ranges[2].verdict, "not_seen");
  ASSERT_EQ(rows.fixes.size(), 1U);
  EXPECT_EQ(rows.fixes[0].verdict, "gap");
  EXPECT_DOUBLE_EQ(*rows.fixes[0].error_m, 0.5);
  EXPECT_FALSE(rows.fixes[0].heading_rad);
  EXPECT_FALSE(rows.fixes[0].var_x_m2);
  ASSERT_TRUE(rows.estimate);
  EXPECT_EQ(rows.estimate->heading_rad, 0.25) << "the odometry's";
}

TEST(ToRows, TwoAnswersAreTwoRowsAndNoEstimate) {
  FrameAnswer answer;
  answer.fix.verdict = localisation::FixVerdict::kAmbiguous;
  answer.fix.position_m = Eigen::Vector2d(0, 1);
  answer.fix.other_position_m = Eigen::Vector2d(0, -1);
  const AnswerRows rows = to_rows(5, 1.0, answer, map_of_three(), nullptr, {});
  ASSERT_EQ(rows.fixes.size(), 2U);
  EXPECT_EQ(rows.fixes[0].y_m, 1);
  EXPECT_EQ(rows.fixes[1].y_m, -1);
  EXPECT_FALSE(rows.fixes[0].error_m) << "no truth";
  EXPECT_FALSE(rows.estimate);
}

TEST(ToRows, NoFixIsOneRowWithItsVerdict) {
  const AnswerRows rows = to_rows(5, 1.0, {}, map_of_three(), nullptr, {});
  ASSERT_EQ(rows.fixes.size(), 1U);
  EXPECT_EQ(rows.fixes[0].verdict, "too_few");
  EXPECT_FALSE(rows.fixes[0].x_m);
}

}  // namespace
}  // namespace twocone::runs
