// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/estimator.h"

#include <gtest/gtest.h>

namespace twocone::estimation {
namespace {

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
