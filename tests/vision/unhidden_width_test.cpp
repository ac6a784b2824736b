// SPDX-License-Identifier: Apache-2.0
#include "vision/unhidden_width.h"

#include <random>

#include <gtest/gtest.h>

namespace twocone::vision {
namespace {

constexpr double kBelieved_m = 0.05;
constexpr double kTrue_m = 0.06;

/// The width of which a share is hidden.
OutlineWidth width_of(double expected_px, double hidden, double noise_px) {
  return {.expected_px = expected_px,
          .seen_px = expected_px * kTrue_m / kBelieved_m * (1 - hidden) + noise_px,
          .sigma_px = 0.1};
}

TEST(UnhiddenWidth, IsTheGreatestOnWhichManyAgree) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise_px(0, 0.1);
  std::uniform_real_distribution<double> expected_px(10, 30);
  std::uniform_real_distribution<double> varying(0.1, 0.8);
  UnhiddenWidth unhidden;
  for (int i = 0; i < 100; ++i) {
    const double expected = expected_px(random);
    unhidden.add(width_of(expected, 0, noise_px(random)), kBelieved_m);
    unhidden.add(width_of(expected, 0.3, noise_px(random)), kBelieved_m);
    unhidden.add(width_of(expected, varying(random), noise_px(random)), kBelieved_m);
  }
  // A few that are too wide, as where something of that colour stands beside it.
  for (int i = 0; i < 5; ++i) unhidden.add(width_of(20, -0.5, 0), kBelieved_m);
  EXPECT_NEAR(unhidden.radius_m(), kTrue_m, 0.02 * kTrue_m);
  EXPECT_FALSE(unhidden.is_hidden(width_of(20, 0, -0.2), kBelieved_m));
  EXPECT_TRUE(unhidden.is_hidden(width_of(20, 0.15, 0), kBelieved_m));
}

TEST(UnhiddenWidth, DoesNotDependOnTheRadiusThatIsBelieved) {
  UnhiddenWidth unhidden;
  for (const double believed_m : {0.03, 0.06, 0.1}) {
    unhidden.add({.expected_px = 100 * believed_m, .seen_px = 6, .sigma_px = 0.1}, believed_m);
  }
  EXPECT_NEAR(unhidden.radius_m(), 0.06, 3e-4);
  EXPECT_FALSE(unhidden.is_hidden({.expected_px = 3, .seen_px = 6, .sigma_px = 0.1}, 0.03));
  EXPECT_TRUE(unhidden.is_hidden({.expected_px = 3, .seen_px = 4, .sigma_px = 0.1}, 0.03));
}

// Catches a landmark that is kept although nearly all of its sightings showed a part of it.
TEST(UnhiddenWidth, CountsTheWidthsOfAPart) {
  UnhiddenWidth unhidden;
  for (int i = 0; i < 30; ++i) unhidden.add(width_of(10 + 0.1 * i, 0.4, 0), kBelieved_m);
  EXPECT_EQ(unhidden.narrow_count(), 0U);
  for (int i = 0; i < 15; ++i) unhidden.add(width_of(10 + 0.1 * i, 0, 0), kBelieved_m);
  EXPECT_EQ(unhidden.narrow_count(), 30U);
  EXPECT_EQ(unhidden.count(), 45U);
}

// Catches a thin pipe that is left out where it is near, since blur widened it where it was far.
TEST(UnhiddenWidth, AllowsForBlur) {
  constexpr double kBlur_px2 = 0.6;
  const auto blurred = [](double expected_px) {
    return OutlineWidth{.expected_px = expected_px, .seen_px = expected_px + kBlur_px2 / expected_px, .sigma_px = 0.05};
  };
  UnhiddenWidth unhidden;
  for (int i = 0; i < 60; ++i) unhidden.add(blurred(1.5 + 0.01 * i), kBelieved_m);
  for (int i = 0; i < 30; ++i) {
    unhidden.add(blurred(6 + 0.1 * i), kBelieved_m);
    EXPECT_FALSE(unhidden.is_hidden(blurred(6 + 0.1 * i), kBelieved_m));
  }
  EXPECT_EQ(unhidden.narrow_count(), 0U);
}

TEST(UnhiddenWidth, KnowsNothingBeforeTheFirst) {
  const UnhiddenWidth unhidden;
  EXPECT_EQ(unhidden.radius_m(), 0);
  EXPECT_FALSE(unhidden.is_hidden({.expected_px = 10, .seen_px = 1, .sigma_px = 0.1}, 0.05));
}

}  // namespace
}  // namespace twocone::vision
