// SPDX-License-Identifier: Apache-2.0
#include "localisation/trajectory_error.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace twocone::localisation {
namespace {

/// A few roundings of numbers of size 10.
constexpr double kRounding = 1e-13;

TEST(TrajectoryErrorTest, OfNoPairThereIsNone) {
  EXPECT_FALSE(absolute_error({}));
  EXPECT_FALSE(relative_error({}, 1));
  EXPECT_FALSE(relative_error_over({}, 1));
  EXPECT_FALSE(alignment({}));
  EXPECT_THROW((void)relative_error({}, 0), std::invalid_argument);
  EXPECT_THROW((void)relative_error_over({}, 0), std::invalid_argument);
}

// By hand: all are shifted by (3, 4), which is 5 m. One of four is also turned by a right angle: root of (pi/2)^2 / 4.
TEST(TrajectoryErrorTest, AShiftIsAnAbsoluteErrorAlone) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < 4; ++i) pairs.push_back({{double(i), 0, 0}, {i + 3.0, 4, i == 2 ? std::numbers::pi / 2 : 0}});
  const auto absolute = absolute_error(pairs);
  ASSERT_TRUE(absolute);
  EXPECT_EQ(absolute->count, 4U);
  EXPECT_NEAR(absolute->rmse_m, 5, kRounding);
  EXPECT_NEAR(absolute->mean_m, 5, kRounding);
  EXPECT_NEAR(absolute->max_m, 5, kRounding);
  EXPECT_NEAR(absolute->rmse_rad, std::numbers::pi / 4, kRounding);

  pairs[2].estimate.heading_rad = 0;
  const auto relative = relative_error(pairs, 1);
  ASSERT_TRUE(relative);
  EXPECT_EQ(relative->count, 3U);
  EXPECT_NEAR(relative->rmse_m, 0, kRounding);
  EXPECT_NEAR(relative->rmse_rad, 0, kRounding);
}

// By hand: the reference moves 1 m per step along x. The estimate moves 1.1, 1.2, 1.0, 1.0 m. Errors of single steps
// are 0.1, 0.2, 0, 0; of two steps 0.3 and 0; absolute errors are 0, 0.1, 0.3, 0.3, 0.3.
TEST(TrajectoryErrorTest, RelativeErrorsAreOfSegmentsThatDoNotOverlap) {
  const std::vector<PosePair> pairs{{{0, 0, 0}, {0, 0, 0}},
                                    {{1, 0, 0}, {1.1, 0, 0}},
                                    {{2, 0, 0}, {2.3, 0, 0}},
                                    {{3, 0, 0}, {3.3, 0, 0}},
                                    {{4, 0, 0}, {4.3, 0, 0}}};
  const auto one = relative_error(pairs, 1);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->count, 4U);
  EXPECT_NEAR(one->rmse_m, std::sqrt((0.01 + 0.04) / 4), kRounding);
  EXPECT_NEAR(one->mean_m, 0.3 / 4, kRounding);
  EXPECT_NEAR(one->max_m, 0.2, kRounding);
  const auto two = relative_error(pairs, 2);
  ASSERT_TRUE(two);
  EXPECT_EQ(two->count, 2U);
  EXPECT_NEAR(two->rmse_m, std::sqrt(0.09 / 2), kRounding);
  EXPECT_FALSE(relative_error(pairs, 5));

  const auto over = relative_error_over(pairs, 1.5);  // each segment ends after 2 m
  ASSERT_TRUE(over);
  EXPECT_EQ(over->count, 2U);
  EXPECT_NEAR(over->max_m, 0.3, kRounding);
  EXPECT_NEAR(absolute_error(pairs)->rmse_m, std::sqrt((0.01 + 3 * 0.09) / 5), kRounding);
}

// By hand: a right-angled corner is driven as two straight segments of 1 m. The estimate starts turned by 90 degrees.
// Relative errors are 0, since each segment is relative to its own start.
TEST(TrajectoryErrorTest, RelativeErrorsDoNotSeeWhereTheTrajectoryBegins) {
  const std::vector<PosePair> pairs{{{0, 0, 0}, {5, 5, std::numbers::pi / 2}},
                                    {{1, 0, std::numbers::pi / 2}, {5, 6, std::numbers::pi}},
                                    {{1, 1, std::numbers::pi / 2}, {4, 6, std::numbers::pi}}};
  const auto relative = relative_error(pairs, 1);
  ASSERT_TRUE(relative);
  EXPECT_NEAR(relative->max_m, 0, kRounding);
  EXPECT_NEAR(relative->rmse_rad, 0, kRounding);
}

// By hand: a square of side 2 turned by 30 degrees about the origin and shifted by (1, -2): the answer undoes both.
TEST(TrajectoryErrorTest, AlignmentFindsTheTurnAndShift) {
  const Pose planted{1, -2, std::numbers::pi / 6};
  std::vector<PosePair> pairs;
  for (const Pose& corner : {Pose{0, 0, 0}, Pose{2, 0, 1}, Pose{2, 2, 2}, Pose{0, 2, 3}}) {
    pairs.push_back({moved(planted, corner), corner});
  }
  const auto found = alignment(pairs);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->x_m, planted.x_m, kRounding);
  EXPECT_NEAR(found->y_m, planted.y_m, kRounding);
  EXPECT_NEAR(found->heading_rad, planted.heading_rad, kRounding);
  for (PosePair& pair : pairs) pair.estimate = moved(*found, pair.estimate);
  EXPECT_NEAR(absolute_error(pairs)->max_m, 0, kRounding);
  EXPECT_NEAR(absolute_error(pairs)->rmse_rad, 0, kRounding);
}

// By hand (Umeyama): estimates (1, 0), (-1, 0) onto references (0, 2.2), (0, -1.8): the rotation is 90 degrees, the
// means are (0, 0) and (0, 0.2), and the aligned estimates are (0, 1.2), (0, -0.8).
TEST(TrajectoryErrorTest, AlignmentHasNoScale) {
  const std::vector<PosePair> pairs{{{0, 2.2, 0}, {1, 0, 0}}, {{0, -1.8, 0}, {-1, 0, 0}}};
  const auto found = alignment(pairs);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->heading_rad, std::numbers::pi / 2, kRounding);
  EXPECT_NEAR(found->y_m, 0.2, kRounding);
  const Pose first = moved(*found, pairs[0].estimate);
  EXPECT_NEAR(first.y_m, 1.2, kRounding);
}

TEST(TrajectoryErrorTest, OnePlaceDeterminesNoTurn) {
  const std::vector<PosePair> pairs{{{1, 1, 0}, {2, 2, 0}}, {{1, 1, 0}, {2, 2, 1}}};
  EXPECT_FALSE(alignment(pairs));
}

}  // namespace
}  // namespace twocone::localisation
