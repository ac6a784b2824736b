// SPDX-License-Identifier: Apache-2.0
#include "localisation/chi_squared.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <boost/math/distributions/chi_squared.hpp>

namespace twocone::localisation {
namespace {

/// Finite sums (Abramowitz & Stegun 26.4.4 and 26.4.5): each term follows from the one before, half^k / k!, with k an
/// integer or a half-integer.
double by_finite_sums(double value, int degrees_of_freedom) {
  const double half = value / 2;
  const bool odd = degrees_of_freedom % 2 != 0;
  double k = odd ? 0.5 : 0;
  double term = std::exp(-half) * (odd ? 2 * std::sqrt(half) * std::numbers::inv_sqrtpi : 1);
  double sum = odd ? std::erfc(std::sqrt(half)) : 0;
  for (int left = degrees_of_freedom / 2; left > 0; --left) {
    sum += term;
    k += 1;
    term *= half / k;
  }
  return sum;
}

TEST(ChiSquaredTail, AgreesWithFiniteSums) {
  for (int n = 1; n <= 100; ++n) {
    for (const double x : {1e-3, 0.3, 1.0, 2.7, 15.1, 40.0, 150.0}) {
      const double expected = by_finite_sums(x, n);
      // Up to 50 terms have one rounding more each; the exponent's own rounding adds x / 2 of it. Twice: for both
      // sides.
      const double tolerance = 2 * (100 + x) * std::numeric_limits<double>::epsilon() * expected;
      EXPECT_NEAR(chi_squared_tail(x, n), expected, tolerance + 1e-300) << "n " << n << " x " << x;
    }
  }
}

TEST(ChiSquaredTail, BeyondAHundred) {
  for (const int n : {101, 300, 5000}) {
    const boost::math::chi_squared reference(n);
    const double x = boost::math::quantile(boost::math::complement(reference, 1e-4));
    EXPECT_NEAR(chi_squared_tail(x, n), 1e-4, 1e-14) << n;
  }
}

TEST(ChiSquaredTail, HasAnAnswerForEveryNumber) {
  EXPECT_EQ(chi_squared_tail(0, 1), 1);
  EXPECT_EQ(chi_squared_tail(-1, 5), 1);
  EXPECT_EQ(chi_squared_tail(1e-30, 400), 1);  // its gamma function overflows
  EXPECT_EQ(chi_squared_tail(1e300, 3), 0);
  EXPECT_EQ(chi_squared_tail(std::numeric_limits<double>::infinity(), 3), 0);
  EXPECT_EQ(chi_squared_tail(std::numeric_limits<double>::infinity(), 200), 0);
  EXPECT_EQ(chi_squared_tail(std::numeric_limits<double>::quiet_NaN(), 3), 0);
}

}  // namespace
}  // namespace twocone::localisation
