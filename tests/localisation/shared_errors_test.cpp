// SPDX-License-Identifier: Apache-2.0
// Errors that all frames share: those of the map and of the rig. A fix states them, and the track does not average them
// away.
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "localisation/least_squares_fix.h"
#include "tests/localisation/a_drive.h"

namespace twocone::localisation {
namespace {

constexpr double kSharedRange_m = 0.02;  ///< an error of all ranges alike, as of a wrong mirror separation
constexpr double kPlace_m = 0.01;
constexpr double kOwnRange_m = 0.002;
constexpr double kOwnBearing_rad = 0.001;
/// 95 % quantile of chi-squared of two numbers, and of three.
constexpr double kTwo95 = 5.991;
constexpr double kThree95 = 7.815;

const std::vector<Eigen::Vector2d> kPlaces_m = {{-2.5, -2.0}, {-2.6, 0.4}, {-1.4, 2.2}, {1.7, 2.1}, {2.6, 0.3}};

/// A room as the robot does not know it: the places, and the error of all ranges.
struct Room {
  std::vector<Eigen::Vector2d> truth_m;
  double range_m = 0;
};

Room draw(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Room room{kPlaces_m, kSharedRange_m * normal(random)};
  for (Eigen::Vector2d& place_m : room.truth_m) place_m += kPlace_m * Eigen::Vector2d(normal(random), normal(random));
  return room;
}

/// Measures the room from a pose. The shared errors are the one of all ranges, then x and y of each landmark.
std::vector<LandmarkMeasurement> measure(const Room& room, const Pose& pose, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto count = Eigen::Index(1 + 2 * room.truth_m.size());
  std::vector<LandmarkMeasurement> all;
  for (std::size_t i = 0; i < room.truth_m.size(); ++i) {
    const Eigen::Vector2d to_m = room.truth_m[i] - Eigen::Vector2d(pose.x_m, pose.y_m);
    LandmarkMeasurement& m = all.emplace_back();
    m.landmark_m = kPlaces_m[i];
    m.range_m = to_m.norm() + room.range_m + kOwnRange_m * normal(random);
    m.bearing_rad =
        wrap_angle_rad(std::atan2(to_m.y(), to_m.x()) - pose.heading_rad + kOwnBearing_rad * normal(random));
    m.covariance = Eigen::Vector2d(kOwnRange_m * kOwnRange_m, kOwnBearing_rad * kOwnBearing_rad).asDiagonal();
    m.by_shared = BySharedErrors<2>::Zero(2, count);
    m.by_shared(0, 0) = kSharedRange_m;
    m.place_by_shared = BySharedErrors<2>::Zero(2, count);
    m.place_by_shared.middleCols<2>(1 + 2 * Eigen::Index(i)) = kPlace_m * Eigen::Matrix2d::Identity();
  }
  return all;
}

Eigen::Vector3d off(const Fix& fix, const Pose& pose) {
  return {fix.position_m->x() - pose.x_m, fix.position_m->y() - pose.y_m,
          wrap_angle_rad(*fix.heading_rad - pose.heading_rad)};
}

/// The greatest difference of a share near 95 % of `count` independent draws: four standard errors.
double tolerance(int count) { return 4 * std::sqrt(0.95 * 0.05 / count); }

TEST(SharedErrors, AFixStatesThem) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  constexpr int kRooms = 1500;
  int held = 0;
  double chi_squared = 0;
  for (int i = 0; i < kRooms; ++i) {
    const Room room = draw(random);
    const Pose pose{place(random), place(random), turn(random)};
    const Fix fix = fix_by_least_squares(measure(room, pose, random));
    ASSERT_EQ(fix.verdict, FixVerdict::kOk) << "room " << i;
    ASSERT_TRUE(fix.outliers.empty()) << "room " << i;
    const Eigen::Vector3d error = off(fix, pose);
    held += error.dot(fix.covariance->inverse() * error) < kThree95 * fix.widening ? 1 : 0;
    chi_squared += fix.chi_squared / fix.degrees_of_freedom;
    // The whole covariance is that of the own noise plus that of the shared errors, to the accuracy of the directions
    // in which the landmarks are seen.
    const Eigen::Matrix3d sum = *fix.own_covariance + fix.by_shared * fix.by_shared.transpose();
    EXPECT_LT((sum - *fix.covariance).norm(), 1e-9 * fix.covariance->norm());
  }
  EXPECT_NEAR(double(held) / kRooms, 0.95, tolerance(kRooms) + 0.005);
  // The mean of chi-squared over its 7 degrees of freedom has a standard deviation of sqrt(2 / 7 / kRooms).
  EXPECT_NEAR(chi_squared / kRooms, 1, 4 * std::sqrt(2.0 / 7 / kRooms));
}

TEST(SharedErrors, AnOutlierIsStillFound) {
  std::mt19937_64 random(6);
  const Pose pose{0.3, -0.4, 0.7};
  for (std::size_t wrong = 0; wrong < kPlaces_m.size(); ++wrong) {
    auto measurements = measure(draw(random), pose, random);
    *measurements[wrong].range_m += 10 * kPlace_m + 10 * kSharedRange_m;
    const Fix fix = fix_by_least_squares(measurements);
    EXPECT_EQ(fix.verdict, FixVerdict::kOk);
    EXPECT_EQ(fix.outliers, std::vector<int>{int(wrong)});
  }
}

TEST(SharedErrors, TheErrorOfOneFixFollowsFromTheErrorsThemselves) {
  // Without noise the fix is off by its derivative times the errors, to second order.
  std::mt19937_64 random(7);
  const Pose pose{-0.6, 0.9, 2.1};
  Room room = draw(random);
  auto measurements = measure(room, pose, random);
  Eigen::VectorXd errors(1 + 2 * Eigen::Index(kPlaces_m.size()));
  errors[0] = room.range_m / kSharedRange_m;
  for (std::size_t i = 0; i < kPlaces_m.size(); ++i) {
    const Eigen::Vector2d to_m = room.truth_m[i] - Eigen::Vector2d(pose.x_m, pose.y_m);
    measurements[i].range_m = to_m.norm() + room.range_m;
    measurements[i].bearing_rad = wrap_angle_rad(std::atan2(to_m.y(), to_m.x()) - pose.heading_rad);
    errors.segment<2>(1 + 2 * Eigen::Index(i)) = (room.truth_m[i] - kPlaces_m[i]) / kPlace_m;
  }
  const Fix fix = fix_by_least_squares(measurements);
  const Eigen::Vector3d expected = fix.by_shared * errors;
  // The second order is the square of an error over the distance: 2e-4 m.
  EXPECT_LT((off(fix, pose) - expected).norm(), 3e-4);
  EXPECT_GT(expected.norm(), 3e-3);
}

/// Drives robots through rooms, with a fix in each frame. @returns the share of track ellipses at the end of the drives
/// that hold the truth @param is_stated whether the fixes state which part of their errors is shared
double track_ellipses(bool is_stated, const Eigen::Vector3d& wheel_sigmas = Eigen::Vector3d::Zero()) {
  constexpr int kRooms = 250;
  constexpr int kFrames = 60;
  const Eigen::Index shared = 1 + 2 * Eigen::Index(kPlaces_m.size());
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  int held = 0;
  for (int i = 0; i < kRooms; ++i) {
    const Room room = draw(random);
    Drive drive(std::uint64_t(100 + i));
    // The wheels' errors follow the others.
    const bool are_wheels_wrong = !wheel_sigmas.isZero();
    const Eigen::Index count = shared + (are_wheels_wrong ? 3 : 0);
    BySharedErrors<3> by_wheels;
    WheelGeometry believed = kWheels;
    if (are_wheels_wrong) {
      by_wheels = BySharedErrors<3>::Zero(3, count);
      by_wheels.rightCols<3>() = wheel_sigmas.asDiagonal();
      const double share = wheel_sigmas[0] * normal(random);
      by_wheels.rightCols<3>().col(1).setZero();
      by_wheels.rightCols<3>()(1, 0) = wheel_sigmas[0];  // both wheels together
      believed.radius_m = kWheels.radius_m / (1 + share);
      believed.separation_m = kWheels.separation_m - wheel_sigmas[2] * normal(random);
    }
    PoseFilter filter(believed, kNoise, by_wheels);
    for (int frame = 0; frame < kFrames; ++frame) {
      drive.step().report_readings(filter);
      if (are_wheels_wrong && frame > 0 && frame % 20 != 0) continue;  // odometry counts between the fixes
      auto measurements = measure(room, drive.truth(), random);
      for (LandmarkMeasurement& m : measurements) {
        m.by_shared.conservativeResizeLike(BySharedErrors<2>::Zero(2, count));
        m.place_by_shared.conservativeResizeLike(BySharedErrors<2>::Zero(2, count));
      }
      Fix fix = fix_by_least_squares(measurements);
      if (!is_stated) {
        fix.own_covariance = fix.covariance;
        fix.by_shared = {};
      }
      filter.correct(fix);
    }
    const PoseEstimate estimate = *filter.estimate();
    const Eigen::Vector2d error = drive.error(estimate.pose).head<2>();
    held += error.dot(estimate.covariance.topLeftCorner<2, 2>().inverse() * error) < kTwo95 ? 1 : 0;
  }
  return double(held) / kRooms;
}

TEST(SharedErrors, TheTrackDoesNotAverageThemAway) {
  EXPECT_NEAR(track_ellipses(true), 0.95, tolerance(250) + 0.01);
  EXPECT_LT(track_ellipses(false), 0.75);  // as independent errors they would seem to average away
}

TEST(SharedErrors, WrongWheelsAreCountedBetweenFixes) {
  EXPECT_NEAR(track_ellipses(true, {0.03, 0, 0.005}), 0.95, tolerance(250) + 0.01);
}

TEST(SharedErrors, ATrackOfFixesFromOnePlaceEndsAtTheSharedPart) {
  // Many fixes at one place average their own noise away; the rest stays.
  std::mt19937_64 random(9);
  const Room room = draw(random);
  const Pose pose{0.2, 0.1, -0.4};
  PoseFilter filter(kWheels, {.slip = 1e-6, .correlation_s = 2, .angle_rad = 1e-6});
  Fix fix;
  for (int i = 0; i < 400; ++i) {
    filter.predict(0.1 * i, 0, 0);
    fix = fix_by_least_squares(measure(room, pose, random));
    filter.correct(fix);
  }
  const Eigen::Matrix3d shared = fix.by_shared * fix.by_shared.transpose();
  const Eigen::Matrix3d left = filter.estimate()->covariance - shared;
  const double left_m2 = left.topLeftCorner<2, 2>().norm();
  EXPECT_LT(left_m2, 0.1 * shared.topLeftCorner(2, 2).norm());
}

}  // namespace
}  // namespace twocone::localisation
