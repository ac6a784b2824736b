// SPDX-License-Identifier: Apache-2.0
#include "localisation/chi_squared.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <boost/math/distributions/chi_squared.hpp>

namespace twocone::localisation {
namespace {

TEST(ChiSquaredTail, AgreesWithAnotherLibrary) {
  for (int n = 1; n <= 100; ++n) {
    const boost::math::chi_squared reference(n);
    for (const double x : {1e-3, 0.3, 1.0, 2.7, 15.1, 40.0, 150.0}) {
      const double expected = boost::math::cdf(boost::math::complement(reference, x));
      // Up to 50 terms have one rounding more each; the exponent's own rounding adds x / 2 of it.
      const double tolerance = (100 + x) * std::numeric_limits<double>::epsilon() * expected;
      EXPECT_NEAR(chi_squared_tail(x, n), expected, tolerance + 1e-300) << "n " << n << " x " << x;
    }
  }
}

TEST(ChiSquaredTail, BeyondAHundredByTheCubeRoot) {
  for (const int n : {101, 300, 5000}) {
    const boost::math::chi_squared reference(n);
    const double x = boost::math::quantile(boost::math::complement(reference, 1e-4));
    EXPECT_NEAR(chi_squared_tail(x, n), 1e-4, 3e-6) << n;
  }
}

TEST(ChiSquaredTail, HasAnAnswerForEveryNumber) {
  EXPECT_EQ(chi_squared_tail(0, 1), 1);
  EXPECT_EQ(chi_squared_tail(-1, 5), 1);
  EXPECT_EQ(chi_squared_tail(1e300, 3), 0);
  EXPECT_EQ(chi_squared_tail(std::numeric_limits<double>::infinity(), 200), 0);
  EXPECT_EQ(chi_squared_tail(std::numeric_limits<double>::quiet_NaN(), 3), 0);
}

}  // namespace
}  // namespace twocone::localisation
