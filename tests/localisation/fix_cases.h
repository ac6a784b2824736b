// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "localisation/least_squares_fix.h"

namespace twocone::localisation {

inline LandmarkMeasurement ranged(double x_m, double y_m, double range_m, double sigma_m = 0.01) {
  LandmarkMeasurement m{.landmark_m = {x_m, y_m}, .range_m = range_m, .bearing_rad = {}};
  m.covariance(0, 0) = sigma_m * sigma_m;
  return m;
}

/// Expects the place of a fix of ranges.
inline void expect_at(const Fix& fix, FixVerdict verdict, double x_m, double y_m, double tolerance_m) {
  ASSERT_EQ(fix.verdict, verdict) << to_string(fix.verdict) << ", not " << to_string(verdict);
  ASSERT_TRUE(fix.position_m);
  EXPECT_NEAR(fix.position_m->x(), x_m, tolerance_m) << "x, m";
  EXPECT_NEAR(fix.position_m->y(), y_m, tolerance_m) << "y, m";
  EXPECT_FALSE(fix.heading_rad) << "ranges determine no heading";
}

/// A room of landmarks and a pose in it, with the noise of ranges and bearings.
struct FixCase {
  Pose truth;
  std::vector<Eigen::Vector2d> landmarks_m;
  double sigma_range_m = 0.01;
  double sigma_bearing_rad = 0.004;
  double correlation = 0;
};

/// Noisy measurements of a case; `has_range` and `has_bearing` are for all landmarks.
inline std::vector<LandmarkMeasurement> measure(const FixCase& c, std::mt19937_64& random, bool has_range = true,
                                                bool has_bearing = true) {
  std::normal_distribution<double> normal;
  std::vector<LandmarkMeasurement> all;
  for (const Eigen::Vector2d& l : c.landmarks_m) {
    const double dx_m = l.x() - c.truth.x_m;
    const double dy_m = l.y() - c.truth.y_m;
    const double a = normal(random);
    const double b = c.correlation * a + std::sqrt(1 - c.correlation * c.correlation) * normal(random);
    LandmarkMeasurement m{.landmark_m = l, .range_m = {}, .bearing_rad = {}};
    if (has_range) m.range_m = std::abs(std::hypot(dx_m, dy_m) + c.sigma_range_m * a);
    if (has_bearing) {
      m.bearing_rad = wrap_angle_rad(std::atan2(dy_m, dx_m) - c.truth.heading_rad + c.sigma_bearing_rad * b);
    }
    const double cov = c.correlation * c.sigma_range_m * c.sigma_bearing_rad;
    m.covariance << c.sigma_range_m * c.sigma_range_m, cov, cov, c.sigma_bearing_rad * c.sigma_bearing_rad;
    all.push_back(m);
  }
  return all;
}

/// `count` landmarks and a pose, anywhere in a room of 6 m by 5 m, no landmark nearer than 0.3 m to the robot or
/// another.
inline FixCase random_case(std::mt19937_64& random, int count) {
  std::uniform_real_distribution<double> x(-3, 3);
  std::uniform_real_distribution<double> y(-2.5, 2.5);
  std::uniform_real_distribution<double> turn(-3.14159, 3.14159);
  FixCase c;
  c.truth = {x(random), y(random), turn(random)};
  while (int(c.landmarks_m.size()) < count) {
    const Eigen::Vector2d l(x(random), y(random));
    bool is_clear = (l - Eigen::Vector2d(c.truth.x_m, c.truth.y_m)).norm() > 0.3;
    for (const Eigen::Vector2d& other : c.landmarks_m) is_clear = is_clear && (l - other).norm() > 0.3;
    if (is_clear) c.landmarks_m.push_back(l);
  }
  return c;
}

/// (x, y, heading) error of a fix; the heading's is 0 where it has none.
inline Eigen::Vector3d error_of(const Fix& fix, const Pose& truth) {
  return {fix.position_m->x() - truth.x_m, fix.position_m->y() - truth.y_m,
          fix.heading_rad ? wrap_angle_rad(*fix.heading_rad - truth.heading_rad) : 0};
}

}  // namespace twocone::localisation
