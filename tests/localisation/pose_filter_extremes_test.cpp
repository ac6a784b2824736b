// SPDX-License-Identifier: Apache-2.0
// Tests of the filter at the limits of doubles and of the first order: input is refused, or the covariance is true.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "localisation/least_squares_fix.h"
#include "tests/localisation/a_drive.h"

namespace twocone::localisation {
namespace {

void expect_sane(const PoseFilter& filter) {
  const auto e = filter.estimate();
  if (!e) return;
  EXPECT_TRUE(std::isfinite(e->pose.x_m) && std::isfinite(e->pose.y_m) && std::isfinite(e->pose.heading_rad));
  EXPECT_TRUE(e->covariance.allFinite());
  EXPECT_GE(e->covariance.diagonal().minCoeff(), 0);
}

TEST(PoseFilterExtremes, AWayBeyondNumbersIsRefusedAndNothingChanged) {
  for (const auto& [from_rad, to_rad] : {std::pair{-1.5e308, 1.5e308}, {0.0, 1e150}, {0.0, 1e300}, {0.0, -1e200}}) {
    PoseFilter filter(kWheels, kNoise);
    filter.predict(0, from_rad, 0);
    filter.correct(fix_at({1, 2, 0.3}, 1e-6 * Eigen::Matrix3d::Identity()));
    EXPECT_THROW(filter.predict(1, to_rad, 0), std::invalid_argument) << to_rad;
    EXPECT_EQ(filter.estimate()->pose, (Pose{1, 2, 0.3}));
    expect_sane(filter);
    EXPECT_NO_THROW(filter.predict(1, from_rad, 0.1)) << "the reading before it still counts";
    EXPECT_NEAR(filter.estimate()->pose.heading_rad, 0.3 + 0.1 * 0.05 / 0.3, 1e-9);
  }
}

TEST(PoseFilterExtremes, WhatIsNoCovarianceIsRefused) {
  Eigen::Matrix3d indefinite = Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal();
  indefinite(0, 1) = indefinite(1, 0) = 0.02;
  Eigen::Matrix3d asymmetric = Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal();
  asymmetric(0, 2) = 0.003;
  Eigen::Matrix3d negative = Eigen::Vector3d(0.01, 0.01, -0.01).asDiagonal();
  for (const Eigen::Matrix3d& bad : {indefinite, asymmetric, negative}) {
    PoseFilter filter(kWheels, kNoise);
    EXPECT_EQ(filter.correct(fix_at({}, bad)), FixUse::kNoSigma);
    EXPECT_FALSE(filter.estimate());
    EXPECT_THROW(PoseHypothesis({{}, bad}, kNoise), std::invalid_argument);
    filter = filter_at({}, 0.01 * Eigen::Matrix3d::Identity());
    EXPECT_EQ(filter.correct(fix_at({}, bad)), FixUse::kNoSigma);
    Fix two = fix_at({0.01, 0, 0}, 0.01 * Eigen::Matrix3d::Identity());
    two.verdict = FixVerdict::kAmbiguous;
    two.other_position_m = Eigen::Vector2d(5, 5);
    two.other_heading_rad = 0;
    two.other_covariance = bad;
    EXPECT_EQ(filter.correct(two), FixUse::kNoSigma);
    EXPECT_EQ(filter.estimate()->pose.x_m, 0);
    expect_sane(filter);
  }
  EXPECT_THROW(PoseHypothesis({{std::nan(""), 0, 0}, Eigen::Matrix3d::Identity()}, kNoise), std::invalid_argument);

  // The same holds for a fix: a measurement with an asymmetric covariance is invalid, as in triangulation.
  LandmarkMeasurement m;
  m.landmark_m = {1, 0};
  m.range_m = 1;
  m.bearing_rad = 0;
  m.covariance << 1e-4, 1e-5, 0, 1e-4;
  LandmarkMeasurement good = m;
  good.landmark_m = {0, 1};
  good.bearing_rad = std::numbers::pi / 2;
  good.covariance(1, 0) = 1e-5;
  const std::vector<LandmarkMeasurement> both{m, good};
  EXPECT_EQ(fix_by_least_squares(both).unusable, 1);
}

// Catches a heading error that counts only sideways: a stated 71 mm along a path of 10 m, where 1.2 m is true.
TEST(PoseFilterExtremes, AHeadingThatIsHardlyKnownMakesTheWayItselfVague) {
  std::mt19937_64 random(61);
  std::normal_distribution<double> normal;
  for (const double sigma_rad : {0.02, 0.1, 0.3, 0.5, 1.0}) {
    for (const int steps : {1, 150}) {
      for (const double turn_rad : {0.0, 1.3}) {
        const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-6, 1e-6, sigma_rad * sigma_rad).asDiagonal();
        PoseFilter filter = filter_at({}, covariance, {.slip = 1e-6, .correlation_s = 2, .angle_rad = 1e-6});
        const double half_rad = turn_rad * 0.3 / 2 / 0.05;  // half of the difference of the wheels' angles
        for (int i = 1; i <= steps; ++i) {
          const double done = double(i) / steps;
          filter.predict(10 * done, 200 * done - half_rad * done, 200 * done + half_rad * done);
        }
        const PoseEstimate e = *filter.estimate();
        const Eigen::Matrix2d information = e.covariance.topLeftCorner<2, 2>().inverse();
        constexpr int kDraws = 4000;
        int half = 0;
        int nearly_all = 0;
        for (int k = 0; k < kDraws; ++k) {
          const Pose truth = drive_arc({1e-3 * normal(random), 1e-3 * normal(random), sigma_rad * normal(random)},
                                       10 - half_rad * 0.05, 10 + half_rad * 0.05, 0.3);
          const Eigen::Vector2d error(truth.x_m - e.pose.x_m, truth.y_m - e.pose.y_m);
          const double d2 = error.dot(information * error);
          half += d2 < 1.386;
          nearly_all += d2 < 13.816;
        }
        std::printf("sigma %.2f steps %d turn %.1f inside_50 %.1f inside_999 %.2f along_mm %.0f\n", sigma_rad, steps,
                    turn_rad, 100.0 * half / kDraws, 100.0 * nearly_all / kDraws, 1e3 * std::sqrt(e.covariance(0, 0)));
        EXPECT_GT(half, 0.45 * kDraws) << sigma_rad << " rad, steps " << steps << ", turn " << turn_rad;
        EXPECT_GE(nearly_all, 0.995 * kDraws) << sigma_rad << " rad, steps " << steps << ", turn " << turn_rad;
      }
    }
  }
}

// Catches NaN and negative variances where numbers differ much in size: each call works, or is refused.
TEST(PoseFilterExtremes, NoSizeOfNumbersMakesItInsane) {
  std::mt19937_64 random(62);
  std::uniform_real_distribution<double> exponent(-320, 308);
  std::uniform_int_distribution<int> coin(0, 3);
  const auto any = [&] { return (coin(random) < 2 ? 1 : -1) * std::pow(10, exponent(random)); };
  int refused = 0;
  int taken = 0;
  for (int run = 0; run < 2000; ++run) {
    PoseFilter filter(kWheels, {.slip = 0.01, .correlation_s = std::abs(any()) + 1e-320, .angle_rad = 0.003});
    double t_s = 0;
    for (int i = 0; i < 6; ++i) {
      try {
        filter.predict(t_s, coin(random) == 0 ? any() : 0.3 * i, coin(random) == 0 ? any() : 0.2 * i);
      } catch (const std::invalid_argument&) {
        ++refused;
      }
      t_s += coin(random) == 0 ? std::abs(any()) : 0.1;
      if (!std::isfinite(t_s)) break;
      const bool is_usual = coin(random) < 2;
      Fix fix = fix_at(is_usual ? Pose{} : Pose{any(), any(), any()},
                       Eigen::Vector3d(std::abs(any()), std::abs(any()), std::abs(any())).asDiagonal());
      if (coin(random) == 0) {
        LandmarkMeasurement m;
        m.landmark_m = is_usual ? Eigen::Vector2d(1, 2) : Eigen::Vector2d(any(), any());
        m.range_m = is_usual ? 2.2 : std::abs(any());
        m.covariance(0, 0) = std::abs(any());
        fix.verdict = FixVerdict::kWeak;
        fix.measurements = {m};
      }
      const FixUse use = filter.correct(fix);
      taken += use == FixUse::kTaken;
      expect_sane(filter);
      if (::testing::Test::HasFailure()) FAIL() << "run " << run << " fix " << i << " " << to_string(use);
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(taken, 100);
}

}  // namespace
}  // namespace twocone::localisation
