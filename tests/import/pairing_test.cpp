// SPDX-License-Identifier: Apache-2.0
#include "apps/import/stamps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::importer {
namespace {

using testing::ElementsAre;

std::vector<Stamp> at_ms(std::initializer_list<int> times) {
  std::vector<Stamp> stamps;
  for (const int t : times) stamps.push_back(std::chrono::milliseconds(t));
  return stamps;
}

constexpr Stamp kLimit = std::chrono::milliseconds(33);

TEST(Pairing, TakesTheNearestAndLeavesOutDistantImages) {
  const auto pairs = pair_images(at_ms({0, 66, 133, 200}), at_ms({7, 74, 170, 203}), kLimit);
  EXPECT_THAT(pairs, ElementsAre(Pair{0, 0}, Pair{1, 1}, Pair{3, 3})) << "133 and 170 ms are 37 ms apart";
}

TEST(Pairing, TheNearerOfTwoGetsTheImage) {
  // The image at 20 ms is also within the limit of that at 0 ms. Pairing in order of time would lose the better pair.
  EXPECT_THAT(pair_images(at_ms({0, 22}), at_ms({20}), kLimit), ElementsAre(Pair{1, 0}));
}

TEST(Pairing, CamerasThatAreExactlyHalfAPeriodApartLoseNoImage) {
  const auto pairs = pair_images(at_ms({0, 66, 132}), at_ms({33, 99, 165}), kLimit);
  EXPECT_THAT(pairs, ElementsAre(Pair{0, 0}, Pair{1, 1}, Pair{2, 2}));
}

TEST(Pairing, PairsFollowOneAnotherInBothCameras) {
  // The nearest pair is 10 with 11. Then 12 could only pair with 0 across that pair.
  const auto pairs = pair_images(at_ms({10, 12}), at_ms({0, 11}), kLimit);
  ASSERT_EQ(pairs.size(), 1U);
}

TEST(Pairing, OfTwiceTheRateEverySecondImageIsLost) {
  const auto upper = at_ms({0, 33, 66, 99, 132});
  const auto pairs = pair_images(at_ms({1, 67, 133}), upper, std::chrono::milliseconds(16));
  EXPECT_THAT(pairs, ElementsAre(Pair{0, 0}, Pair{1, 2}, Pair{2, 4}));
  EXPECT_THAT(lost_before(upper, {0, 2, 4}), ElementsAre(0, 1, 1));
}

TEST(Pairing, MedianPeriodIsThatOfMostImages) {
  EXPECT_EQ(median_period(at_ms({0, 67, 134, 334, 400})), std::chrono::milliseconds(67));
  EXPECT_FALSE(median_period(at_ms({5})).has_value());
}

TEST(Pairing, SkippedImagesAndThoseNeverStoredAreLost) {
  // Image 1 is in no pair, and the image exposed at 200 ms was never stored.
  const auto times = at_ms({0, 67, 133, 267, 333});
  EXPECT_THAT(lost_before(times, {0, 2, 3, 4}), ElementsAre(0, 1, 1, 0));
  EXPECT_THAT(lost_before(times, {1, 4}), ElementsAre(1, 3)) << "67 to 333 ms: 133, 200, 267";
  EXPECT_THAT(lost_before(at_ms({5}), {0}), ElementsAre(0));
}

}  // namespace
}  // namespace twocone::importer
