// SPDX-License-Identifier: Apache-2.0
// Compares the fix with the same minimum in 50-digit arithmetic.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_bin_float.hpp>

#include "tests/localisation/fix_cases.h"
#include "tests/support/special_doubles.h"

namespace twocone::localisation {
namespace {

using Exact = boost::multiprecision::cpp_bin_float_50;

using twocone::testing_support::kEps;

struct Reference {
  Exact p[3];  // x, y, heading
  Exact covariance[3][3];
  double condition = 0;  ///< of the whitened, column-scaled Jacobian: the root of its normal matrix's condition
};

/// Gauss-Newton by the normal equations from `start`; 50 digits can afford their squared condition. The measurements
/// have no correlation.
Reference minimise(const std::vector<LandmarkMeasurement>& all, const Exact start[3], int n) {
  Reference ref;
  std::copy(start, start + 3, ref.p);
  for (int step = 0; step < 40; ++step) {
    Exact a[3][4] = {};
    const auto add_row = [&](const Exact(&row)[3], const Exact& e, const Exact& weight) {
      for (int i = 0; i < n; ++i) {
        for (int k = 0; k < n; ++k) a[i][k] += weight * row[i] * row[k];
        a[i][3] += weight * row[i] * e;
      }
    };
    for (const auto& m : all) {
      const Exact dx = Exact(m.landmark_m.x()) - ref.p[0];
      const Exact dy = Exact(m.landmark_m.y()) - ref.p[1];
      const Exact r = sqrt(dx * dx + dy * dy);
      if (m.range_m) add_row({-dx / r, -dy / r, 0}, Exact(*m.range_m) - r, 1 / Exact(m.covariance(0, 0)));
      if (m.bearing_rad) {
        const Exact turn = ref.p[2] + Exact(*m.bearing_rad);
        const Exact c = cos(turn);
        const Exact s = sin(turn);
        const Exact e = atan2(dx * s - dy * c, dx * c + dy * s);
        add_row({dy / (r * r), -dx / (r * r), -1}, e, 1 / Exact(m.covariance(1, 1)));
      }
    }
    Eigen::Matrix3d scaled = Eigen::Matrix3d::Identity();
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < n; ++k) scaled(i, k) = double(a[i][k] / sqrt(a[i][i] * a[k][k]));
    }
    // Compute the inverse by Gauss and Jordan.
    Exact w[3][6] = {};
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < n; ++k) w[i][k] = a[i][k];
      w[i][3 + i] = 1;
    }
    for (int i = 0; i < n; ++i) {
      const Exact pivot = w[i][i];
      for (auto& v : w[i]) v /= pivot;
      for (int k = 0; k < n; ++k) {
        if (k == i) continue;
        const Exact factor = w[k][i];
        for (int j = 0; j < 6; ++j) w[k][j] -= factor * w[i][j];
      }
    }
    Exact size = 0;
    for (int i = 0; i < n; ++i) {
      Exact d = 0;
      for (int k = 0; k < n; ++k) {
        d += w[i][3 + k] * a[k][3];
        ref.covariance[i][k] = w[i][3 + k];
      }
      ref.p[i] += d;
      size = std::max(size, Exact(abs(d)));
    }
    if (size < 1e-35) {
      // The norm of scaled^-1 follows from the exact inverse; scaled has a norm of at most 3.
      double norm = 0;
      for (int i = 0; i < n; ++i) {
        for (int k = 0; k < n; ++k) norm = std::max(norm, std::abs(double(w[i][3 + k] * sqrt(a[i][i] * a[k][k]))));
      }
      ref.condition = std::sqrt(9 * norm);
      break;
    }
  }
  return ref;
}

/// The bound is condition number times epsilon times lengths of 5 m times a small constant, here 32 for some thirty
/// roundings of a row. The whitened residuals, at most some 3, add condition^2 times themselves (Wedin), in units of
/// the largest sigma over the length.
double bound(double condition, double sigma_over_length) {
  return 32 * kEps * 5 * condition * (1 + condition * 3 * sigma_over_length);
}

void expect_exact(const std::vector<LandmarkMeasurement>& all, const Fix& fix, double sigma_over_length, int i) {
  const int n = fix.heading_rad ? 3 : 2;
  const Exact start[3] = {fix.position_m->x(), fix.position_m->y(), fix.heading_rad.value_or(0)};
  const Reference ref = minimise(all, start, n);
  ASSERT_GT(ref.condition, 0) << "case " << i << ": 50 digits did not converge";
  const double tolerance = bound(ref.condition, sigma_over_length);
  EXPECT_NEAR(double(start[0] - ref.p[0]), 0, tolerance) << "case " << i << " condition " << ref.condition;
  EXPECT_NEAR(double(start[1] - ref.p[1]), 0, tolerance) << "case " << i << " condition " << ref.condition;
  if (n == 3) {
    EXPECT_NEAR(double(start[2] - ref.p[2]), 0, tolerance) << "case " << i << " condition " << ref.condition;
  }
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      const double scale = std::sqrt(double(ref.covariance[r][r] * ref.covariance[c][c]));
      // The relative error of its gradients is that of the position, relative to distances of 0.3 m or more.
      EXPECT_NEAR((*fix.covariance)(r, c) / fix.widening, double(ref.covariance[r][c]),
                  scale * ref.condition * (64 * kEps + 10 * tolerance))
          << "case " << i << " entry " << r << c;
    }
  }
}

TEST(LeastSquaresExact, NoisyRoomsAgreeWithFiftyDigits) {
  std::mt19937_64 random(51);
  int given = 0;
  for (int i = 0; i < 600; ++i) {
    const FixCase c = random_case(random, 3 + i % 5);
    const bool has_range = i % 3 != 1;
    const bool has_bearing = i % 3 != 2;
    const auto all = measure(c, random, has_range, has_bearing);
    const Fix fix = fix_by_least_squares(all);
    if (fix.verdict != FixVerdict::kOk || !fix.outliers.empty()) continue;
    ++given;
    expect_exact(all, fix, 0.01, i);
  }
  EXPECT_GT(given, 450);
}

TEST(LeastSquaresExact, T21SigmasFrom1e6To1) {
  std::mt19937_64 random(52);
  std::uniform_real_distribution<double> exponent(-6, 0);
  std::normal_distribution<double> normal;
  int given = 0;
  double worst = 0;
  for (int i = 0; i < 600; ++i) {
    FixCase c = random_case(random, 3 + i % 4);
    auto all = measure(c, random, true, i % 2 == 0);
    for (auto& m : all) {
      const Eigen::Vector2d d = m.landmark_m - Eigen::Vector2d(c.truth.x_m, c.truth.y_m);
      const double sigma_m = std::pow(10, exponent(random));
      // Errors are half a sigma and at most 2 cm, so that the geometry remains that of the case.
      m.range_m = d.norm() + std::clamp(0.5 * sigma_m * normal(random), -0.02, 0.02);
      m.covariance(0, 0) = sigma_m * sigma_m;
      if (!m.bearing_rad) continue;
      const double sigma_rad = std::pow(10, exponent(random)) * 0.1;
      m.bearing_rad =
          std::atan2(d.y(), d.x()) - c.truth.heading_rad + std::clamp(0.5 * sigma_rad * normal(random), -0.01, 0.01);
      m.covariance(1, 1) = sigma_rad * sigma_rad;
    }
    const Fix fix = fix_by_least_squares(all);
    if (fix.verdict != FixVerdict::kOk || !fix.outliers.empty()) continue;
    ++given;
    const Exact start[3] = {fix.position_m->x(), fix.position_m->y(), fix.heading_rad.value_or(0)};
    worst = std::max(worst, minimise(all, start, fix.heading_rad ? 3 : 2).condition);
    expect_exact(all, fix, 1e-6, i);
  }
  EXPECT_GT(given, 300);
  EXPECT_GT(worst, 1e3) << "mixed sigmas make it hard";
}

}  // namespace
}  // namespace twocone::localisation
