// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/widths.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace twocone::survey {
namespace {

constexpr double kBelieved_m = 0.15;

/// A landmark of that radius, and the widths that its true and its nearest and farthest images have.
struct Seen {
  double radius_m, nearest_px, farthest_px;
};

/// Returns the landmarks as the widths of 40 frames show them. Both views add `widening_px` to each.
std::vector<Landmark> measured(const std::vector<Seen>& all, double widening_px) {
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < all.size(); ++i) {
    Landmark& landmark = landmarks.emplace_back();
    landmark.name = std::to_string(i);
    landmark.radius_m = kBelieved_m;
  }
  std::vector<vision::CalibrationFrame> frames(40);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double part = double(k) / double(frames.size() - 1);
      const double true_px = all[i].nearest_px + part * (all[i].farthest_px - all[i].nearest_px);
      for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
        vision::LandmarkSighting seen;
        seen.landmark = i;
        seen.side = side;
        seen.sighting.width = vision::OutlineWidth{
            .expected_px = true_px * kBelieved_m / all[i].radius_m, .seen_px = true_px + widening_px, .sigma_px = 0.03};
        frames[k].sightings.push_back(seen);
      }
    }
  }
  measure_radii(frames, landmarks);
  return landmarks;
}

// Catches a far landmark whose radius is its own few and blurred pixels' alone: a fifteenth too large here.
TEST(Widths, FarLandmarksThatLookLikeTheNearOnesAreAsWide) {
  const std::vector<Seen> all{{0.2, 24, 12}, {0.2, 20, 9}, {0.2, 18, 8}, {0.2, 6, 3}, {0.2, 5, 3}};
  const std::vector<Landmark> found = measured(all, 0.25);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(found[i].radius_m, all[i].radius_m, 0.02 * all[i].radius_m) << i;
    EXPECT_NEAR(found[i].radius_m, all[i].radius_m, 2 * found[i].sigma.radius_m) << i;
    EXPECT_LT(found[i].sigma.radius_m, 0.03 * all[i].radius_m) << i;
  }
}

// Catches radii that are drawn together although the widths show that they differ.
TEST(Widths, LandmarksThatDifferKeepTheirOwnRadii) {
  const std::vector<Seen> all{{0.10, 20, 8}, {0.15, 24, 10}, {0.20, 26, 12}, {0.13, 12, 6}, {0.25, 14, 7}};
  const std::vector<Landmark> found = measured(all, 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(found[i].radius_m, all[i].radius_m, 0.015 * all[i].radius_m) << i;
    EXPECT_NEAR(found[i].radius_m, all[i].radius_m, 2 * found[i].sigma.radius_m) << i;
  }
}

// Catches a sigma that is stated for how alike the others are rather than for what was measured: nobody knows by two
// landmarks how alike a room's are.
TEST(Widths, ARadiusBesideOneOtherIsItsOwn) {
  const std::vector<Seen> all{{0.2, 24, 12}, {0.19, 6, 3}};
  const std::vector<Landmark> found = measured(all, 0);
  EXPECT_NEAR(found[1].radius_m, 0.19, 0.005);
  EXPECT_GT(found[1].sigma.radius_m, 0.03 * 0.19);
}

// Catches a landmark without widths that gets a radius or a sigma.
TEST(Widths, WithoutWidthsARadiusStays) {
  std::vector<Landmark> landmarks(3);
  for (Landmark& landmark : landmarks) landmark.radius_m = kBelieved_m;
  measure_radii(std::vector<vision::CalibrationFrame>(2), landmarks);
  for (const Landmark& landmark : landmarks) EXPECT_EQ(landmark.radius_m, kBelieved_m);
}

}  // namespace
}  // namespace twocone::survey
