// SPDX-License-Identifier: Apache-2.0
// Calibrations in which the landmarks are not known: a first pose that defines the world, measured distances, and a rig
// that is held with its uncertainty.
#include "vision/calibration.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/vision/drive_among_landmarks.h"
#include "vision/uncertain_rig.h"

namespace twocone::vision {
namespace {

/// A survey of the lab: landmarks start some centimetres off and have wide priors.
CalibrationProblem survey_of(const DriveSettings& world, const Rig& believed = lab_rig()) {
  CalibrationProblem problem{believed, WheelBelief{0.05, 0.30}, world.landmarks, drive_among_landmarks(world), {}, {}};
  problem.systematic_px = 0;
  problem.first_pose_covariance = 1e-14 * Eigen::Matrix3d::Identity();
  problem.frames.front().start = pose_on_loop(0);
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    Landmark& l = problem.landmarks[i];
    l.x_m += 0.03 * std::sin(1.7 * double(i));
    l.y_m += 0.03 * std::cos(2.3 * double(i));
    l.top_m += 0.01;
    l.sigma = {1, 1, 0.3, 0};
  }
  return problem;
}

/// True minus found places, and their joint covariance.
struct PlaceErrors {
  Eigen::VectorXd errors_m;
  Eigen::MatrixXd covariance;

  [[nodiscard]] double chi_squared() const { return errors_m.dot(covariance.ldlt().solve(errors_m)); }
};

PlaceErrors errors_of(const CalibrationResult& result, const std::vector<Landmark>& truth) {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd errors(2 * Eigen::Index(truth.size()));
  for (std::size_t i = 0; i < truth.size(); ++i) {
    errors.segment<2>(2 * Eigen::Index(i)) = place_m(truth[i]) - place_m(result.landmarks[i]);
    const Eigen::Index at = kRigNumbers + kLandmarkNumbers * Eigen::Index(i);
    columns.insert(columns.end(), {at + kPlaceX, at + kPlaceY});
  }
  return {errors, result.belief_covariance(columns, columns)};
}

BeliefErrors exact_rig() {
  BeliefErrors errors;
  errors.rig = BySharedErrors<kRigNumbers>::Zero(kRigNumbers, 1);
  errors.times = BySharedErrors<kTimeNumbers>::Zero(kTimeNumbers, 1);
  return errors;
}

// 12 numbers in each of 12 seeds: chi-squared of 144 is between 104 and 191 in 99 % of the cases.
TEST(SurveyBundle, StatesHowFarItsLandmarksAreFromTheTruthSeeds) {
  double chi_squared = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    DriveSettings world;
    world.seed = seed;
    CalibrationProblem problem = survey_of(world);
    problem.held_rig = exact_rig();
    const CalibrationResult result = calibrate(problem);
    ASSERT_EQ(result.verdict, CalibrationVerdict::kOk);
    const PlaceErrors places = errors_of(result, world.landmarks);
    EXPECT_LT(places.errors_m.cwiseAbs().maxCoeff(), 0.004) << seed;
    chi_squared += places.chi_squared();
  }
  EXPECT_GT(chi_squared, 104);
  EXPECT_LT(chi_squared, 191);
}

// Catches a held rig whose error does not count: the mirrors are 3 mm farther apart than believed, so that the map is
// too small by a per cent.
TEST(SurveyBundle, AHeldRigThatIsWrongCountsInTheCovariance) {
  DriveSettings world;
  MirrorViewSettings upper = lab_view(0.55);
  upper.lens_height_m += 0.003;
  world.rig.upper = MirrorView(upper);
  CalibrationProblem problem = survey_of(world);
  problem.held_rig = exact_rig();
  const PlaceErrors surprised = errors_of(calibrate(problem), world.landmarks);
  EXPECT_GT(surprised.errors_m.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_GT(surprised.chi_squared(), 100);
  problem.held_rig->rig(kSeparation, 0) = 0.003;
  const CalibrationResult result = calibrate(problem);
  EXPECT_LT(errors_of(result, world.landmarks).chi_squared(), 30);
  // Rig and map are wrong together.
  EXPECT_EQ(result.rig->mirror_separation_m(), problem.rig.mirror_separation_m());
  EXPECT_NEAR(std::sqrt(result.belief_covariance(kSeparation, kSeparation)), 0.003, 1e-9);
}

// The errors of one belief are correlated: where both rims are wrong alike, and the lens lies so that nothing moves,
// the covariance must be that of the sum and not that of independent numbers.
TEST(SurveyBundle, TheErrorsOfAHeldRigKeepTheirCorrelation) {
  const DriveSettings world;
  CalibrationProblem problem = survey_of(world);
  problem.held_rig = exact_rig();
  BySharedErrors<kRigNumbers>& rig = problem.held_rig->rig;
  // Both views turned alike: the map turns with them about the first pose, which the first pose's heading takes back.
  rig(rig_number(Side::kLower, kAzimuth), 0) = rig(rig_number(Side::kUpper, kAzimuth), 0) = 0.01;
  const CalibrationResult together = calibrate(problem);
  const auto spread = [](const CalibrationResult& result) {
    const Eigen::Index at = kRigNumbers;
    return std::sqrt(result.belief_covariance.block<2, 2>(at, at).trace());
  };
  // A turn of the body's axes by 0.01 rad turns a landmark at 2.5 m by 25 mm. Two independent turns shear the views.
  EXPECT_NEAR(spread(together), 0.01 * (place_m(world.landmarks[0]) - pose_on_loop(0).head<2>()).norm(), 0.003);
}

TEST(SurveyBundle, TheFirstPoseDefinesTheWorld) {
  DriveSettings world;
  CalibrationProblem problem = survey_of(world);
  problem.held_rig = exact_rig();
  problem.frames.front().start = Eigen::Vector3d(1, 2, 0.5);
  for (Landmark& l : problem.landmarks) {
    // The same room, seen from that pose.
    const Eigen::Vector2d in_body = Eigen::Rotation2Dd(-pose_on_loop(0).z()) * (place_m(l) - pose_on_loop(0).head<2>());
    const Eigen::Vector2d there = Eigen::Vector2d(1, 2) + Eigen::Rotation2Dd(0.5) * in_body;
    l.x_m = there.x();
    l.y_m = there.y();
  }
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.verdict, CalibrationVerdict::kOk);
  EXPECT_LT((*result.poses.front() - Eigen::Vector3d(1, 2, 0.5)).norm(), 1e-6);
  // A first pose that is less certain moves the whole map by its error.
  problem.first_pose_covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-14).asDiagonal();
  const Eigen::Index at = kRigNumbers;
  const Eigen::Matrix2d more =
      calibrate(problem).belief_covariance.block<2, 2>(at, at) - result.belief_covariance.block<2, 2>(at, at);
  EXPECT_LT((more - 1e-4 * Eigen::Matrix2d::Identity()).cwiseAbs().maxCoeff(), 1e-7);
}

/// The distance between two landmarks of a survey over the true one.
struct Scale {
  double value = 0;
  double sigma = 0;
};

Scale scale_of(const CalibrationResult& result, const std::vector<Landmark>& truth) {
  const Eigen::Vector2d between_m = place_m(truth[0]) - place_m(truth[3]);
  const Eigen::Index a = kRigNumbers;
  const Eigen::Index b = kRigNumbers + 3 * kLandmarkNumbers;
  const auto& c = result.belief_covariance;
  const Eigen::Matrix2d apart = c.block<2, 2>(a, a) + c.block<2, 2>(b, b) - c.block<2, 2>(a, b) - c.block<2, 2>(b, a);
  const Eigen::Vector2d along = between_m.normalized();
  return {(place_m(result.landmarks[0]) - place_m(result.landmarks[3])).norm() / between_m.norm(),
          std::sqrt(along.dot(apart * along)) / between_m.norm()};
}

// Catches a distance that is not used, or used with another weight: without the sizes of the mirrors, nothing else
// fixes the scale as well.
TEST(SurveyBundle, AMeasuredDistanceFixesTheScale) {
  DriveSettings world;
  MirrorViewSettings upper = lab_view(0.55);
  upper.lens_height_m += 0.003;
  world.rig.upper = MirrorView(upper);
  CalibrationProblem problem = survey_of(world);
  problem.priors.mirror_separation_m = 0.003;
  const CalibrationResult without = calibrate(problem);
  ASSERT_EQ(without.verdict, CalibrationVerdict::kOk);
  EXPECT_GT(scale_of(without, world.landmarks).sigma, 0.004);
  EXPECT_LT(std::abs(scale_of(without, world.landmarks).value - 1), 3 * scale_of(without, world.landmarks).sigma);
  const double distance_m = (place_m(world.landmarks[1]) - place_m(world.landmarks[4])).norm();
  problem.distances = {{1, 4, distance_m + 0.001, 0.002}};
  const CalibrationResult with = calibrate(problem);
  ASSERT_EQ(with.verdict, CalibrationVerdict::kOk);
  EXPECT_LT(scale_of(with, world.landmarks).sigma, 0.0015);
  EXPECT_LT(std::abs(scale_of(with, world.landmarks).value - 1), 3 * scale_of(with, world.landmarks).sigma);
}

// Widths of images tell radii as shares of the map. Here the believed map is 5 % too small, its radii too, and a tape
// measure gives the scale. Radii that count as lengths stay 5 % too small.
TEST(SurveyBundle, RadiiFollowTheScaleWhereTheyAreSharesOfTheMap) {
  const DriveSettings world;
  const double small = 0.95;
  MirrorViewSettings upper = lab_view(0.55);
  upper.lens_height_m -= (1 - small) * lab_rig().mirror_separation_m();
  CalibrationProblem problem = survey_of(world, {MirrorView(lab_view(0.25)), MirrorView(upper)});
  problem.priors.mirror_separation_m = 0.03;
  const Eigen::Vector2d start = pose_on_loop(0).head<2>();
  for (Landmark& l : problem.landmarks) {
    const Eigen::Vector2d place = start + small * (place_m(l) - start);
    l.x_m = place.x();
    l.y_m = place.y();
    l.radius_m *= small;
    l.sigma.radius_m = 0.002 * l.radius_m;
  }
  problem.distances = {{1, 4, (place_m(world.landmarks[1]) - place_m(world.landmarks[4])).norm(), 0.001}};
  const CalibrationResult lengths = calibrate(problem);
  problem.radii_follow_scale = true;
  const CalibrationResult shares = calibrate(problem);
  ASSERT_EQ(lengths.verdict, CalibrationVerdict::kOk);
  ASSERT_EQ(shares.verdict, CalibrationVerdict::kOk);
  EXPECT_NEAR(scale_of(shares, world.landmarks).value, 1, 0.002);
  for (std::size_t i = 0; i < world.landmarks.size(); ++i) {
    const double true_m = world.landmarks[i].radius_m;
    EXPECT_NEAR(lengths.landmarks[i].radius_m, small * true_m, 0.01 * true_m) << i;
    EXPECT_NEAR(shares.landmarks[i].radius_m, true_m, 0.01 * true_m) << i;
  }
}

TEST(SurveyBundle, RefusesDistancesOutsideTheirDomain) {
  CalibrationProblem problem = survey_of({});
  for (const MeasuredDistance& bad :
       {MeasuredDistance{0, 0, 1, 0.1}, {0, 6, 1, 0.1}, {0, 1, 0, 0.1}, {0, 1, 1, 0}, {0, 1, 1, -1}}) {
    problem.distances = {bad};
    EXPECT_THROW((void)calibrate(problem), std::invalid_argument) << bad.from << bad.to << bad.sigma_m;
  }
  problem.distances.clear();
  problem.first_pose_covariance->setZero();
  EXPECT_THROW((void)calibrate(problem), std::invalid_argument);
  problem.first_pose_covariance.reset();
  problem.frames[0].start = Eigen::Vector3d(0, NAN, 0);
  EXPECT_THROW((void)calibrate(problem), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::vision
