// SPDX-License-Identifier: Apache-2.0
#include "localisation/pose_filter.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "tests/localisation/a_drive.h"
#include "tests/support/error_of.h"
#include "tests/support/special_doubles.h"

namespace twocone::localisation {
namespace {

using twocone::testing_support::kEps;
using twocone::testing_support::kNaN;

/// The squared error of an estimate by its own covariance: chi-squared of three.
double distance2(const Drive& drive, const PoseEstimate& e) {
  const Eigen::Vector3d error = drive.error(e.pose);
  return error.dot(e.covariance.inverse() * error);
}
double position_distance2(const Drive& drive, const PoseEstimate& e) {
  const Eigen::Vector2d error = drive.error(e.pose).head<2>();
  return error.dot(e.covariance.topLeftCorner<2, 2>().inverse() * error);
}

PoseFilter new_filter() { return {kWheels, kNoise}; }

PoseFilter after_frames(Drive& drive, int frames) {
  PoseFilter filter = new_filter();
  for (int i = 0; i < frames; ++i) {
    if (i > 0) drive.step();
    drive.report_readings(filter);
    filter.correct(drive.fix());
  }
  return filter;
}

TEST(PoseFilter, BeatsTheFixes) {
  double fixes2 = 0;
  double estimates2 = 0;
  int inside = 0;
  constexpr int kRuns = 20;
  constexpr int kFrames = 450;
  for (int run = 0; run < kRuns; ++run) {
    Drive drive(100 + std::uint64_t(run));
    PoseFilter filter = new_filter();
    for (int i = 0; i < kFrames; ++i) {
      if (i > 0) drive.step();
      drive.report_readings(filter);
      const Fix fix = drive.fix();
      filter.correct(fix);
      ASSERT_EQ(filter.state(), FilterState::kTracking) << "run " << run << " frame " << i;
      const PoseEstimate e = *filter.estimate();
      fixes2 += drive.error({fix.position_m->x(), fix.position_m->y(), 0}).head<2>().squaredNorm();
      estimates2 += drive.error(e.pose).head<2>().squaredNorm();
      inside += position_distance2(drive, e) < 5.991;
    }
  }
  constexpr double kCount = double(kRuns) * kFrames;
  RecordProperty("fix_rmse_mm", std::to_string(1e3 * std::sqrt(fixes2 / kCount)));
  RecordProperty("estimate_rmse_mm", std::to_string(1e3 * std::sqrt(estimates2 / kCount)));
  RecordProperty("inside_95", std::to_string(100 * inside / kCount));
  EXPECT_LT(estimates2, 0.64 * fixes2) << "RMSE at most 0.8 of the fixes'";
  // There are 9000 estimates, of which some ten in a row share their errors: 95 % scatters by some 0.7 %.
  EXPECT_GT(inside, 0.92 * kCount);
  EXPECT_LT(inside, 0.98 * kCount);
}

TEST(PoseFilter, FiveSecondsWithoutFixesAreHonestAndRecoveredFrom) {
  constexpr int kRuns = 500;
  int inside = 0;
  int pose_inside = 0;
  double blind_mm = 0;
  for (int run = 0; run < kRuns; ++run) {
    Drive drive(1000 + std::uint64_t(run));
    PoseFilter filter = after_frames(drive, 30);
    for (int i = 0; i < 75; ++i) {
      drive.step().report_readings(filter);
      filter.correct(Fix());  // too few
    }
    EXPECT_EQ(filter.state(), FilterState::kTracking);
    inside += position_distance2(drive, *filter.estimate()) < 5.991;
    pose_inside += distance2(drive, *filter.estimate()) < 7.815;
    blind_mm += 1e3 * drive.error(filter.estimate()->pose).head<2>().norm() / kRuns;
    drive.step().report_readings(filter);
    filter.correct(drive.fix());
    ASSERT_EQ(filter.state(), FilterState::kTracking) << "run " << run;
    EXPECT_LT(drive.error(filter.estimate()->pose).head<2>().norm(), 5.3 * kFixSigma_m) << "exp(-5.3^2 / 2) = 1e-6";
  }
  RecordProperty("blind_error_mm", std::to_string(blind_mm));
  RecordProperty("inside_95", std::to_string(100.0 * inside / kRuns));
  // 95 % of 500 scatters by 1 %: four of these sigmas are allowed.
  EXPECT_NEAR(inside / double(kRuns), 0.95, 0.04);
  EXPECT_NEAR(pose_inside / double(kRuns), 0.95, 0.04);
}

TEST(PoseFilter, ACarriedRobotIsFoundWithThreeFixesAndNotBelievedMeanwhile) {
  for (int run = 0; run < 100; ++run) {
    Drive drive(3000 + std::uint64_t(run));
    PoseFilter filter = after_frames(drive, 60);
    drive.carry({1.7 - 0.03 * run, 0.9, -2.1 + 0.04 * run});
    for (int fixes = 1; fixes <= 10; ++fixes) {
      drive.step().report_readings(filter);
      filter.correct(drive.fix());
      EXPECT_EQ(filter.state(), fixes < PoseFilter::kRelocateAfter ? FilterState::kLost : FilterState::kTracking)
          << "run " << run << " fix " << fixes;
      if (filter.state() == FilterState::kTracking) {
        EXPECT_LT(drive.error(filter.estimate()->pose).head<2>().norm(), 5.3 * kFixSigma_m) << "run " << run;
      }
    }
  }
}

TEST(PoseFilter, AWrongFixIsNotTakenAndNotAgainstTheNext) {
  Drive drive(41);
  PoseFilter filter = new_filter();
  for (int i = 0; i < 40; ++i) {
    if (i > 0) drive.step();
    drive.report_readings(filter);
    Fix fix = drive.fix();
    if (i % 10 == 9 || i % 10 == 8) *fix.position_m += Eigen::Vector2d(0.1 * (i % 10), -0.3);  // two that disagree
    filter.correct(fix);
    EXPECT_EQ(filter.state(), i % 10 >= 8 ? FilterState::kLost : FilterState::kTracking) << "frame " << i;
    EXPECT_LT(drive.error(filter.estimate()->pose).head<2>().norm(), 5.3 * kFixSigma_m) << "frame " << i;
  }
}

/// A fix as from two landmarks: one number more than unknowns.
Fix of_pair(Fix fix) {
  fix.degrees_of_freedom = 1;
  return fix;
}

// Catches a track that follows two landmarks in mirrored images: they agree with each other as long as the robot
// stands, or drives straight on.
TEST(PoseFilter, APairThatAgreesWithItselfAloneMovesNothing) {
  for (const double speed_radps : {0.0, 5.0}) {
    Drive drive(51);
    PoseFilter filter = after_frames(drive, 30);
    for (int i = 0; i < 60; ++i) {
      drive.step(speed_radps, speed_radps).report_readings(filter);
      Fix mirrored = of_pair(drive.fix());
      mirrored.position_m->x() = 1 - mirrored.position_m->x();
      mirrored.heading_rad = wrap_angle_rad(std::numbers::pi - *mirrored.heading_rad);
      EXPECT_EQ(filter.correct(mirrored), FixUse::kUnexpected) << "frame " << i;
      EXPECT_EQ(filter.state(), FilterState::kLost);
    }
    EXPECT_LT(drive.error(filter.estimate()->pose).head<2>().norm(), 0.05) << "odometry went on";
    drive.step().report_readings(filter);
    EXPECT_EQ(filter.correct(of_pair(drive.fix())), FixUse::kTaken) << "a pair that is expected is as good as ever";
    EXPECT_EQ(filter.state(), FilterState::kTracking);
  }
}

// The converse: a robot that was carried to a place where it sees two landmarks is found as soon as it turns.
TEST(PoseFilter, ACarriedRobotIsFoundByPairsOnceItTurns) {
  Drive drive(52);
  PoseFilter filter = after_frames(drive, 30);
  drive.carry({1.1, 0.9, -2.1});
  for (int i = 0; i < 5; ++i) {
    drive.step(5, 5).report_readings(filter);
    EXPECT_EQ(filter.correct(of_pair(drive.fix())), FixUse::kUnexpected) << "straight on";
  }
  FixUse use = FixUse::kUnexpected;
  for (int i = 0; i < 3 && use != FixUse::kRelocated; ++i) {
    drive.step(3, 5).report_readings(filter);
    use = filter.correct(of_pair(drive.fix()));
  }
  EXPECT_EQ(use, FixUse::kRelocated);
  EXPECT_LT(drive.error(filter.estimate()->pose).head<2>().norm(), 5.3 * kFixSigma_m);

  // Three landmarks check themselves: three such fixes find a robot that stands still.
  drive.carry({-1.1, 0.2, 1.1});
  for (int i = 1; i <= PoseFilter::kRelocateAfter; ++i) {
    drive.step(0, 0).report_readings(filter);
    use = filter.correct(drive.fix());
    EXPECT_EQ(use, i < PoseFilter::kRelocateAfter ? FixUse::kUnexpected : FixUse::kRelocated);
  }
}

TEST(PoseFilter, WrongFixesBetweenRightOnesNeverRelocate) {
  Drive drive(42);
  PoseFilter filter = new_filter();
  for (int i = 0; i < 60; ++i) {
    if (i > 0) drive.step();
    drive.report_readings(filter);
    Fix fix = drive.fix();
    if (i % 3 != 0) *fix.position_m += Eigen::Vector2d(0.4, 0.3);  // agree with each other, but never three in a row
    filter.correct(fix);
    EXPECT_LT(drive.error(filter.estimate()->pose).head<2>().norm(), 5.3 * 1.5 * kFixSigma_m) << "frame " << i;
  }
}

TEST(PoseFilter, StaysSymmetricAndPositiveOverALongRun) {
  Drive drive(43);
  PoseFilter filter = new_filter();
  PoseHypothesis hypothesis({drive.truth(), 1e-6 * Eigen::Matrix3d::Identity()}, kNoise);
  for (int i = 0; i < 6000; ++i) {
    if (i > 0) drive.step(5 + 3 * std::sin(0.01 * i), 5 - 3 * std::cos(0.013 * i));
    drive.report_readings(filter);
    hypothesis.predict(kStep_s, 0.3 + 0.2 * std::sin(0.01 * i), 0.3, kWheels, kNoise);
    const bool is_blind = i % 400 > 300;
    Fix fix = drive.fix();
    if (i % 7 == 3) *fix.covariance *= 1e-12;  // a fix that claims nanometres
    if (!is_blind && i % 7 != 3) filter.correct(fix);
    if (!is_blind) {
      const PoseEstimate e = hypothesis.estimate();
      ASSERT_TRUE(hypothesis.correct({{e.pose.x_m, e.pose.y_m, e.pose.heading_rad}, *fix.covariance, true}));
    }
    const auto& p = hypothesis.covariance();
    ASSERT_EQ((p - p.transpose()).cwiseAbs().maxCoeff(), 0) << "frame " << i;
    const Eigen::SelfAdjointEigenSolver<PoseHypothesis::Matrix> eigen(p);
    ASSERT_GE(eigen.eigenvalues()[0], -8 * kEps * eigen.eigenvalues()[7]) << "frame " << i;
    ASSERT_TRUE(filter.estimate()->covariance.llt().info() == Eigen::Success) << "frame " << i;
  }
  EXPECT_LT(distance2(drive, *filter.estimate()), 30.7) << "1e-6";
}

TEST(PoseHypothesis, PredictsWhatChanceMakesOfOneLongArc) {
  // All error sources act at once, each drawn here; the errors are so small that curvature adds less than a percent.
  const OdometryNoise noise{.slip = 0.02, .correlation_s = 2, .angle_rad = 0.05};
  const double left = 8.3;
  const double right = 14.9;
  Eigen::Matrix3d start = Eigen::Vector3d(1e-5, 2e-5, 4e-4).asDiagonal();
  const PoseEstimate from{{0.4, -0.3, 0.8}, start};
  PoseHypothesis hypothesis(from, noise);
  hypothesis.predict(0.5, left, right, kWheels, noise);
  const PoseEstimate e = hypothesis.estimate();
  std::mt19937_64 random(44);
  std::normal_distribution<double> normal;
  constexpr int kSamples = 20000;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> with_reading = Eigen::Matrix<double, 3, 2>::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Pose at{0.4 + std::sqrt(1e-5) * normal(random), -0.3 + std::sqrt(2e-5) * normal(random),
                  0.8 + 0.02 * normal(random)};
    double way_m[2];
    double new_error[2];
    for (int w = 0; w < 2; ++w) {
      const double old_error = 0.05 * normal(random);
      new_error[w] = 0.05 * normal(random);
      way_m[w] = 0.05 * ((w ? right : left) + old_error - new_error[w]) * (1 + 0.02 * normal(random));
    }
    const double turn = (way_m[1] - way_m[0]) / 0.3;
    const double radius_m = (way_m[0] + way_m[1]) / 2 / turn;  // the textbook's form suffices for a turn of 1.1 rad
    const Eigen::Vector3d end(at.x_m + radius_m * (std::sin(at.heading_rad + turn) - std::sin(at.heading_rad)),
                              at.y_m - radius_m * (std::cos(at.heading_rad + turn) - std::cos(at.heading_rad)),
                              at.heading_rad + turn);
    const Eigen::Vector3d error(end.x() - e.pose.x_m, end.y() - e.pose.y_m,
                                wrap_angle_rad(end.z() - e.pose.heading_rad));
    sum += error * error.transpose() / kSamples;
    with_reading += error * Eigen::RowVector2d(new_error[0], new_error[1]) / kSamples;
  }
  // A sample covariance of 20000 scatters by 1 % (sqrt(2 / 20000)); four of these, scaled by the sigmas, are allowed.
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double scale = std::sqrt(e.covariance(i, i) * e.covariance(j, j));
      EXPECT_NEAR(sum(i, j), e.covariance(i, j), 0.04 * scale) << i << " " << j;
    }
    for (int w = 0; w < 2; ++w) {
      const double scale = std::sqrt(e.covariance(i, i)) * 0.05;
      EXPECT_NEAR(with_reading(i, w), hypothesis.covariance()(i, 5 + w), 0.04 * scale) << i << " reading " << w;
    }
  }
}

TEST(PoseHypothesis, SlipIsForgottenAtItsRate) {
  PoseHypothesis hypothesis({{}, 1e-6 * Eigen::Matrix3d::Identity()}, kNoise);
  const double prior = kNoise.slip * kNoise.slip;
  EXPECT_DOUBLE_EQ(hypothesis.covariance()(3, 3), prior);
  for (int i = 0; i < 100; ++i) hypothesis.predict(kStep_s, 0.4, 0.3, kWheels, kNoise);
  // The variance is stationary: decay and renewal balance.
  EXPECT_NEAR(hypothesis.covariance()(3, 3), prior, 1e-12 * prior);
  EXPECT_NEAR(hypothesis.covariance()(4, 4), prior, 1e-12 * prior);
  // Cov(slip, x) of one step on dt decays with exp(-dt / correlation).
  const double before = hypothesis.covariance()(0, 3);
  hypothesis.predict(1.0, 0, 0, kWheels, kNoise);
  EXPECT_NEAR(hypothesis.covariance()(0, 3), before * std::exp(-0.5), std::abs(before) * 1e-2);
}

TEST(PoseFilter, ReadingsErrorsDoNotAddUp) {
  // The robot stands still. However often the wheels are read, the pose is off by two readings at most.
  PoseHypothesis hypothesis({{}, 1e-12 * Eigen::Matrix3d::Identity()}, kNoise);
  for (int i = 0; i < 1000; ++i) hypothesis.predict(kStep_s, 0, 0, kWheels, kNoise);
  const double two_readings_m2 = 2 * std::pow(kWheels.radius_m * kNoise.angle_rad, 2) / 2;  // mean of two wheels
  EXPECT_NEAR(hypothesis.estimate().covariance(0, 0), two_readings_m2, 1e-3 * two_readings_m2);
}

TEST(PoseFilter, HeadingGoesThroughPi) {
  Drive drive(45);
  PoseFilter filter = new_filter();
  int crossings = 0;
  double last_rad = drive.truth().heading_rad;
  for (int i = 0; i < 900; ++i) {
    if (i > 0) drive.step(3, 6);
    crossings += std::abs(drive.truth().heading_rad - last_rad) > std::numbers::pi;
    last_rad = drive.truth().heading_rad;
    drive.report_readings(filter);
    if (i % 5 == 0) filter.correct(drive.fix());
    ASSERT_EQ(filter.state(), FilterState::kTracking) << "frame " << i;
    ASSERT_LE(std::abs(filter.estimate()->pose.heading_rad), std::numbers::pi);
    EXPECT_LT(std::abs(drive.error(filter.estimate()->pose).z()), 0.03) << "frame " << i;
  }
  EXPECT_GE(crossings, 4);
}

TEST(PoseFilter, NoTimeAndNoMotion) {
  Drive drive(46);
  PoseFilter filter = new_filter();
  drive.report_readings(filter);
  filter.correct(drive.fix());
  const PoseEstimate before = *filter.estimate();
  filter.predict(drive.t_s(), 0.0, 0.0);
  filter.predict(drive.t_s(), 0.0, 0.0);
  for (int i = 0; i < 3000; ++i) {
    filter.predict(drive.t_s() + kStep_s * i, 0.0, 0.0);
    ASSERT_TRUE(filter.estimate()->covariance.allFinite());
  }
  const PoseEstimate after = *filter.estimate();
  // Readings of 3 mrad on wheels of 5 cm are 0.15 mm each, and twice that over the wheels' separation in heading.
  EXPECT_NEAR(after.pose.x_m, before.pose.x_m, 1e-3);
  EXPECT_NEAR(after.pose.y_m, before.pose.y_m, 1e-3);
  EXPECT_LT(std::sqrt(after.covariance(0, 0)), 1.1 * kFixSigma_m);
  filter.correct(drive.fix());
  EXPECT_EQ(filter.state(), FilterState::kTracking);
}

TEST(PoseFilter, GoesTheWayOfOdometryWithoutFixes) {
  PoseFilter filter = new_filter();
  const Fix fix = fix_at({0.7, -0.4, 2.9}, 1e-6 * Eigen::Matrix3d::Identity());
  Odometry odometry(kWheels, {0.7, -0.4, 2.9});
  for (int i = 0; i <= 300; ++i) {
    const double left = 0.31 * i + std::sin(0.1 * i);
    const double right = 0.37 * i;
    filter.predict(0.05 * i, left, right);
    if (i == 0) filter.correct(fix);
    const Pose& p = odometry.update(left, right);
    const Pose e = filter.estimate()->pose;
    EXPECT_NEAR(e.x_m, p.x_m, 1e-12) << "the same arc, slip and readings' errors 0";
    EXPECT_NEAR(e.y_m, p.y_m, 1e-12);
  }
}

TEST(PoseFilter, SaysNothingBeforeTheFirstFixAndStartsFromNothingLess) {
  PoseFilter filter = new_filter();
  EXPECT_EQ(filter.state(), FilterState::kLost);
  EXPECT_FALSE(filter.estimate());
  Drive drive(47);
  drive.report_readings(filter);
  for (const FixVerdict verdict :
       {FixVerdict::kTooFew, FixVerdict::kContradictory, FixVerdict::kGap, FixVerdict::kWeak, FixVerdict::kAmbiguous}) {
    Fix fix = drive.fix();
    fix.verdict = verdict;
    filter.correct(fix);
    EXPECT_FALSE(filter.estimate()) << to_string(verdict);
  }
  Fix no_heading = drive.fix();
  no_heading.heading_rad.reset();
  filter.correct(no_heading);
  Fix no_covariance = drive.fix();
  no_covariance.covariance.reset();
  filter.correct(no_covariance);
  Fix nan = drive.fix();
  nan.covariance->setConstant(kNaN);
  filter.correct(nan);
  EXPECT_FALSE(filter.estimate());
  filter.correct(drive.fix());
  EXPECT_EQ(filter.state(), FilterState::kTracking);
}

/// A filter that tracks at (0, 0, 0) with the sigmas 0.1 m, 0.1 m, 0.1 rad.
PoseFilter vague_filter() { return filter_at({}, 0.01 * Eigen::Matrix3d::Identity()); }

TEST(PoseFilter, AFixWithoutHeadingUpdatesThePositionOnly) {
  PoseFilter filter = vague_filter();
  Fix fix = fix_at({0.1, -0.05, 0}, Eigen::Vector3d(0.01, 0.01, 0).asDiagonal());
  fix.heading_rad.reset();
  filter.correct(fix);
  const PoseEstimate e = *filter.estimate();
  EXPECT_NEAR(e.pose.x_m, 0.05, 4 * kEps) << "equal sigmas: the middle";
  EXPECT_NEAR(e.pose.y_m, -0.025, 4 * kEps);
  EXPECT_EQ(e.pose.heading_rad, 0);
  EXPECT_NEAR(e.covariance(0, 0), 0.005, 4 * kEps);
  EXPECT_NEAR(e.covariance(2, 2), 0.01, 4 * kEps);
}

TEST(PoseFilter, HeadingsEitherSideOfPiAreNeighbours) {
  PoseFilter filter = filter_at({0, 0, std::numbers::pi - 0.03}, 0.01 * Eigen::Matrix3d::Identity());
  filter.correct(fix_at({0, 0, 0.05 - std::numbers::pi}, 0.01 * Eigen::Matrix3d::Identity()));
  EXPECT_EQ(filter.state(), FilterState::kTracking);
  EXPECT_NEAR(filter.estimate()->pose.heading_rad, 0.01 - std::numbers::pi, 8 * kEps) << "the middle";
}

TEST(PoseFilter, OfAnAmbiguousFixTheAnswerThatIsExpectedIsTaken) {
  Fix fix = fix_at({3, 2, 2}, 0.01 * Eigen::Matrix3d::Identity());
  fix.verdict = FixVerdict::kAmbiguous;
  fix.other_position_m = Eigen::Vector2d(0.1, 0);
  fix.other_covariance = fix.covariance;
  fix.other_heading_rad = 0;
  PoseFilter filter = vague_filter();
  filter.correct(fix);
  EXPECT_NEAR(filter.estimate()->pose.x_m, 0.05, 4 * kEps);
  EXPECT_EQ(filter.state(), FilterState::kTracking);

  PoseFilter torn = vague_filter();
  fix.position_m = Eigen::Vector2d(-0.1, 0);
  fix.heading_rad = 0;
  torn.correct(fix);
  EXPECT_EQ(torn.estimate()->pose.x_m, 0) << "both are expected: neither is taken";

  PoseFilter far = vague_filter();
  fix.position_m = Eigen::Vector2d(3, 2);
  fix.other_position_m = Eigen::Vector2d(-3, 2);
  far.correct(fix);
  EXPECT_EQ(far.estimate()->pose.x_m, 0);
}

TEST(PoseFilter, RefusesWhatIsNoRobotAndNoReading) {
  EXPECT_THROW(PoseFilter({0, 0.3}, kNoise), std::invalid_argument);
  EXPECT_THROW(PoseFilter({0.05, kNaN}, kNoise), std::invalid_argument);
  EXPECT_THROW(PoseFilter(kWheels, {.slip = -0.01}), std::invalid_argument);
  EXPECT_THROW(PoseFilter(kWheels, {.correlation_s = 0}), std::invalid_argument);
  EXPECT_THROW(PoseFilter(kWheels, {.angle_rad = 0}), std::invalid_argument);
  const std::string error = testing_support::error_of<std::invalid_argument>([] {
    PoseFilter({-1, 0.3}, {.slip = 0.01, .correlation_s = 2, .angle_rad = kNaN});
  });
  EXPECT_NE(error.find("radius_m is -1"), std::string::npos) << error;
  EXPECT_NE(error.find("angle_rad is nan"), std::string::npos) << error;
  PoseFilter filter = new_filter();
  EXPECT_THROW(filter.predict(kNaN, 0, 0), std::invalid_argument);
  EXPECT_THROW(filter.predict(0, kNaN, 0), std::invalid_argument);
  filter.predict(1, 0, 0);
  EXPECT_THROW(filter.predict(0.9, 0, 0), std::invalid_argument);
  EXPECT_NO_THROW(filter.predict(1, 0, 0));
}

}  // namespace
}  // namespace twocone::localisation
