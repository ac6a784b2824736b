// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/estimator.h"
#include "apps/runlog/answer_rows.h"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::estimation {
namespace {

config::Map map_of_three() {
  config::Map map;
  map.landmarks = {
      {"red", {1, 0, 0}, 2, 0, 0.1, 0.9}, {"green", {0, 1, 0}, 0, 2, 0.1, 0.9}, {"blue", {0, 0, 1}, -2, -1, 0.1, 0.9}};
  return map;
}

TEST(Method, IsNamedOrRefused) {
  EXPECT_EQ(estimation::method_named("paper"), estimation::Method::kPaper);
  EXPECT_EQ(to_string(estimation::Method::kPaper), "paper");
  EXPECT_EQ(estimation::method_named("outline"), estimation::Method::kOutline);
  EXPECT_EQ(to_string(estimation::Method::kOutline), "outline");
  EXPECT_THAT([] { (void)method_named("better"); },
              testing::ThrowsMessage<std::invalid_argument>("no method 'better'; there are: paper, outline"));
}

TEST(ToRows, JudgesAgainstTheTruthAndLeavesTheRestEmpty) {
  estimation::FrameAnswer answer;
  answer.ranges.resize(3);
  answer.ranges[0].verdict = vision::RangeVerdict::kOk;
  answer.ranges[0].range_m = 1.7;
  answer.ranges[1].verdict = vision::RangeVerdict::kTruncated;
  answer.fix.verdict = localisation::FixVerdict::kGap;
  answer.fix.position_m = Eigen::Vector2d(0.3, 0.4);
  const runlog::PoseRow truth{1, 0, 0, 0};
  const runlog::AnswerRows rows = runlog::to_rows(5, 1.0, answer, map_of_three(), &truth);
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
}

TEST(ToRows, OfAWeakFixTheUnseenDirectionIsThere) {
  estimation::FrameAnswer answer;
  answer.fix.verdict = localisation::FixVerdict::kWeak;
  answer.fix.position_m = Eigen::Vector2d(0.3, 0.4);
  answer.fix.heading_rad = 0.1;
  answer.fix.covariance = Eigen::Matrix3d::Identity();
  (*answer.fix.covariance)(0, 2) = 0.25;
  (*answer.fix.covariance)(1, 2) = -0.5;
  answer.fix.unseen_direction = Eigen::Vector3d(0.6, 0, -0.8);
  const runlog::FixRow row = runlog::to_rows(5, 1.0, answer, map_of_three(), nullptr).fixes.front();
  EXPECT_EQ(row.unseen_x, 0.6);
  EXPECT_EQ(row.unseen_y, 0);
  EXPECT_EQ(row.unseen_heading, -0.8);
  EXPECT_EQ(row.cov_x_heading_m_rad, 0.25);
  EXPECT_EQ(row.cov_y_heading_m_rad, -0.5);
  answer.fix.unseen_direction.reset();
  EXPECT_FALSE(runlog::to_rows(5, 1.0, answer, map_of_three(), nullptr).fixes.front().unseen_x);
}

TEST(ToRows, TwoAnswersAreTwoRowsAndNoEstimate) {
  estimation::FrameAnswer answer;
  answer.fix.verdict = localisation::FixVerdict::kAmbiguous;
  answer.fix.position_m = Eigen::Vector2d(0, 1);
  answer.fix.other_position_m = Eigen::Vector2d(0, -1);
  const runlog::AnswerRows rows = runlog::to_rows(5, 1.0, answer, map_of_three(), nullptr);
  ASSERT_EQ(rows.fixes.size(), 2U);
  EXPECT_EQ(rows.fixes[0].y_m, 1);
  EXPECT_EQ(rows.fixes[1].y_m, -1);
  EXPECT_FALSE(rows.fixes[0].error_m) << "no truth";
}

TEST(ToRows, EachOfTwoAnswersHasItsOwnHeadingAndCovariance) {
  estimation::FrameAnswer answer;
  answer.fix.verdict = localisation::FixVerdict::kAmbiguous;
  answer.fix.position_m = Eigen::Vector2d(0, 1);
  answer.fix.heading_rad = 0.3;
  answer.fix.covariance = Eigen::Vector3d(1e-6, 2e-6, 3e-6).asDiagonal();
  answer.fix.other_position_m = Eigen::Vector2d(0, -1);
  answer.fix.other_covariance = Eigen::Vector3d(4e-6, 5e-6, 0).asDiagonal();  // of a fix without a heading
  answer.fix.outliers = {2, 0};
  const runlog::AnswerRows rows = runlog::to_rows(5, 1.0, answer, map_of_three(), nullptr);
  ASSERT_EQ(rows.fixes.size(), 2U);
  EXPECT_EQ(rows.fixes[0].heading_rad, 0.3);
  EXPECT_EQ(rows.fixes[0].var_heading_rad2, 3e-6);
  EXPECT_EQ(rows.fixes[1].var_x_m2, 4e-6);
  EXPECT_FALSE(rows.fixes[1].heading_rad);
  EXPECT_FALSE(rows.fixes[1].var_heading_rad2);
  EXPECT_EQ(rows.fixes[1].outliers, (std::vector<std::string>{"blue", "red"}));
}

TEST(ToRows, SightingsAreRowsOfTheirView) {
  estimation::FrameAnswer answer;
  answer.ranges.resize(3);
  EXPECT_TRUE(runlog::to_rows(5, 1.0, answer, map_of_three(), nullptr).sightings.empty());
  vision::Sighting& sighting = answer.ranges[1].upper_sighting.emplace();
  sighting.pixel_px = {12.25, 34.5};
  sighting.covariance_px2 << 0.01, 0.002, 0.002, 0.03;
  sighting.edge_noise_px = 0.07;
  const runlog::AnswerRows rows = runlog::to_rows(5, 1.0, answer, map_of_three(), nullptr);
  ASSERT_EQ(rows.sightings.size(), 1U);
  const runlog::SightingRow& row = rows.sightings[0];
  EXPECT_EQ(row.frame, 5U);
  EXPECT_EQ(row.landmark, "green");
  EXPECT_EQ(row.view, "upper");
  EXPECT_EQ(row.column_px, 12.25);
  EXPECT_EQ(row.row_px, 34.5);
  EXPECT_EQ(row.var_column_px2, 0.01);
  EXPECT_EQ(row.cov_px2, 0.002);
  EXPECT_EQ(row.var_row_px2, 0.03);
  EXPECT_EQ(row.edge_noise_px, 0.07);
}

TEST(ToRows, NoFixIsOneRowWithItsVerdict) {
  const runlog::AnswerRows rows = runlog::to_rows(5, 1.0, {}, map_of_three(), nullptr);
  ASSERT_EQ(rows.fixes.size(), 1U);
  EXPECT_EQ(rows.fixes[0].verdict, "too_few");
  EXPECT_FALSE(rows.fixes[0].x_m);
}

// ---- the map's bounds

using localisation::Fix;
using localisation::FixVerdict;

constexpr config::Bounds kBounds{-2, 2, -1.5, 1.5};
constexpr double kSigma_m = 0.0017;

Fix fix_at(double x_m, double y_m) {
  Fix fix;
  fix.verdict = FixVerdict::kOk;
  fix.position_m = Eigen::Vector2d(x_m, y_m);
  fix.heading_rad = 0.3;
  fix.covariance = Eigen::Vector3d(kSigma_m * kSigma_m, kSigma_m * kSigma_m, 1e-6).asDiagonal();
  return fix;
}

Fix checked(Fix fix) {
  estimation::check_bounds(kBounds, fix);
  return fix;
}

// Catches a fix from two mirrored landmarks, a metre behind the wall with a sigma of 1.7 mm, that is accepted as true.
TEST(MapBounds, AFixBehindTheWallIsShownButNoAnswer) {
  for (const auto& [x_m, y_m] : {std::pair{3.0, 0.2}, {-3.0, 0.2}, {0.4, 2.5}, {0.4, -2.5}, {2.5, 2.0}}) {
    const Fix fix = checked(fix_at(x_m, y_m));
    EXPECT_EQ(fix.verdict, FixVerdict::kOutOfBounds) << x_m << " " << y_m;
    EXPECT_EQ(fix.position_m, Eigen::Vector2d(x_m, y_m)) << "still there";
    EXPECT_TRUE(fix.covariance);
    EXPECT_FALSE(is_place(fix)) << "not used for steering";
  }
}

// Catches a robot at the wall whose fix is rejected because of noise, or because of a sigma that is large along the
// wall.
TEST(MapBounds, ARobotAtTheWallIsNotRefused) {
  EXPECT_EQ(checked(fix_at(2, 1.5)).verdict, FixVerdict::kOk);
  EXPECT_EQ(checked(fix_at(2 + 0.99 * estimation::kOutsideSigmas * kSigma_m, 0)).verdict, FixVerdict::kOk);
  EXPECT_EQ(checked(fix_at(2 + 1.01 * estimation::kOutsideSigmas * kSigma_m, 0)).verdict, FixVerdict::kOutOfBounds);
  Fix vague = fix_at(2.4, 0);
  (*vague.covariance)(0, 0) = 0.01;
  EXPECT_EQ(checked(vague).verdict, FixVerdict::kOk) << "4 sigmas of 0.1 m";
  (*vague.covariance)(1, 1) = 1;
  (*vague.covariance)(0, 0) = 1e-6;
  EXPECT_EQ(checked(vague).verdict, FixVerdict::kOutOfBounds) << "vague along the wall only";
}

TEST(MapBounds, OfTwoAnswersTheOneInsideIsLeft) {
  Fix two = fix_at(0.5, 0.7);
  two.verdict = FixVerdict::kAmbiguous;
  two.other_position_m = Eigen::Vector2d(0.5, 2.3);
  two.other_heading_rad = -0.3;
  two.other_covariance = 4 * *two.covariance;
  Fix swapped = two;
  std::swap(swapped.position_m, swapped.other_position_m);
  std::swap(swapped.heading_rad, swapped.other_heading_rad);
  std::swap(swapped.covariance, swapped.other_covariance);
  for (const Fix& fix : {checked(two), checked(swapped)}) {
    EXPECT_EQ(fix.verdict, FixVerdict::kOk);
    EXPECT_EQ(fix.position_m, Eigen::Vector2d(0.5, 0.7));
    EXPECT_EQ(fix.heading_rad, 0.3);
    EXPECT_EQ(fix.covariance, two.covariance);
    EXPECT_FALSE(fix.other_position_m || fix.other_heading_rad || fix.other_covariance);
  }
  Fix both = two;
  both.position_m = Eigen::Vector2d(0.5, -2.3);
  EXPECT_EQ(checked(both).verdict, FixVerdict::kOutOfBounds);
  EXPECT_EQ(checked(both).position_m->y(), -2.3);
  EXPECT_FALSE(checked(both).other_position_m);
  two.other_position_m = Eigen::Vector2d(0.5, -0.7);
  EXPECT_EQ(checked(two).verdict, FixVerdict::kAmbiguous) << "both are inside";
}

TEST(MapBounds, AFixWithoutAPlaceIsNotChecked) {
  Fix weak = fix_at(0, 9);
  weak.verdict = FixVerdict::kWeak;
  EXPECT_EQ(checked(weak).verdict, FixVerdict::kWeak) << "its position may be anywhere along the unseen direction";
  Fix paper = fix_at(0, 9);
  paper.covariance.reset();
  EXPECT_EQ(checked(paper).verdict, FixVerdict::kOk) << "method paper states no sigma, and is not changed";
  EXPECT_EQ(checked({}).verdict, FixVerdict::kTooFew);
}

}  // namespace
}  // namespace twocone::estimation
