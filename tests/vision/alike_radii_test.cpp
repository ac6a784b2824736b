// SPDX-License-Identifier: Apache-2.0
#include "vision/alike_radii.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace twocone::vision {
namespace {

LogRadius radius(double m, double share) { return {std::log(m), share * share}; }

// Catches a spread that is that of the stated sigmas alone, and one that counts them as differences.
TEST(AlikeRadii, TheOthersSayAsMuchAsTheyAgree) {
  const std::array alike{radius(0.3, 0.1), radius(0.20, 0.02), radius(0.21, 0.02), radius(0.19, 0.02)};
  const auto close = as_the_others(alike, 0);
  ASSERT_TRUE(close);
  EXPECT_NEAR(std::exp(close->mean), 0.2, 0.001);
  EXPECT_LT(std::sqrt(close->variance), 0.08);
  EXPECT_GT(std::sqrt(close->variance), 0.02);
  const std::array different{radius(0.3, 0.1), radius(0.10, 0.02), radius(0.20, 0.02), radius(0.40, 0.02)};
  EXPECT_GT(std::sqrt(as_the_others(different, 0)->variance), std::log(2.0));
}

// Catches a radius that counts for itself, and an unknown one that counts for others.
TEST(AlikeRadii, NeitherItselfNorUnknownOnesCount) {
  std::vector<LogRadius> radii{radius(0.20, 0.02), radius(0.21, 0.02), radius(0.19, 0.02)};
  const auto before = as_the_others(radii, 0);
  radii[0] = radius(1, 0.001);
  radii.emplace_back();
  const auto after = as_the_others(radii, 0);
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->mean, before->mean);
  EXPECT_EQ(after->variance, before->variance);
}

TEST(AlikeRadii, OneOtherSaysNothing) {
  const std::array two{radius(0.20, 0.02), radius(0.21, 0.02)};
  EXPECT_FALSE(as_the_others(two, 0));
}

}  // namespace
}  // namespace twocone::vision
