// SPDX-License-Identifier: Apache-2.0
#include "localisation/paper_trilateration.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/localisation/fix_cases.h"
#include "tests/support/special_doubles.h"

namespace twocone::localisation {
namespace {

using twocone::testing_support::kEps;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

Fix trilaterate(const std::vector<LandmarkRange>& ranges) { return fix_by_triangle(ranges); }

// Error of a corner of circles that cross at a good angle: condition near 1, lengths of a few metres, some ten
// roundings.
constexpr double kWell_m = 64 * kEps;
// Error of a corner of circles that touch: an error e in a range r moves it by sqrt(2 e r), here with e = 4 eps, r = 4.
const double kTangent_m = std::sqrt(2 * 4 * kEps * 4);

TEST(PaperTrilateration, T1WellPlaced) {
  expect_at(trilaterate({{{0, 0}, std::sqrt(2.0)}, {{4, 0}, std::sqrt(10.0)}, {{0, 3}, std::sqrt(5.0)}}),
            FixVerdict::kOk, 1, 1, kWell_m);
}

TEST(PaperTrilateration, T22TheCentreIsTheCentroid) {
  expect_at(
      trilaterate({{{0, 0}, std::sqrt(2.0) + 0.05}, {{4, 0}, std::sqrt(10.0) - 0.03}, {{0, 3}, std::sqrt(5.0) + 0.04}}),
      FixVerdict::kOk, 1.0456678374588409, 0.99612158170507931, kWell_m);
}

TEST(PaperTrilateration, T2LandmarksInLineGiveBothAnswers) {
  const Fix fix = trilaterate({{{0, 0}, std::sqrt(3.25)}, {{2, 0}, std::sqrt(3.25)}, {{5, 0}, std::sqrt(18.25)}});
  ASSERT_EQ(fix.verdict, FixVerdict::kAmbiguous);
  ASSERT_TRUE(fix.other_position_m);
  EXPECT_NEAR(fix.position_m->x(), 1, kWell_m);
  EXPECT_NEAR(fix.other_position_m->x(), 1, kWell_m);
  EXPECT_NEAR(std::abs(fix.position_m->y()), 1.5, kWell_m);
  EXPECT_NEAR(fix.position_m->y(), -fix.other_position_m->y(), kWell_m);
}

TEST(PaperTrilateration, T3OnTheLandmarksLine) {
  expect_at(trilaterate({{{0, 0}, 1}, {{2, 0}, 1}, {{5, 0}, 4}}), FixVerdict::kOk, 1, 0, kTangent_m);
}

TEST(PaperTrilateration, T5TwoLandmarksInOnePlaceGiveBothAnswers) {
  const Fix fix = trilaterate({{{0, 0}, std::sqrt(2.0)}, {{0, 0}, std::sqrt(2.0)}, {{4, 0}, std::sqrt(10.0)}});
  ASSERT_EQ(fix.verdict, FixVerdict::kAmbiguous);
  EXPECT_NEAR(fix.position_m->x(), 1, kWell_m);
  EXPECT_NEAR(std::abs(fix.position_m->y()), 1, kWell_m);
  EXPECT_NEAR(fix.position_m->y(), -fix.other_position_m->y(), kWell_m);
}

TEST(PaperTrilateration, T7TangentFromOutsideHasNoNaN) {
  // 0.1 + 0.2 - 0.3 is 5.55e-17 in doubles; the third circle crosses both at a good angle.
  const Fix fix = trilaterate({{{0, 0}, 0.1}, {{0.3, 0}, 0.2}, {{0.1, 0.4}, 0.4}});
  expect_at(fix, FixVerdict::kOk, 0.1, 0, std::sqrt(2 * 4 * kEps * 0.2));
}

TEST(PaperTrilateration, T8TangentFromInside) {
  expect_at(trilaterate({{{0, 0}, 3}, {{1, 0}, 2}, {{3, 4}, 4}}), FixVerdict::kOk, 3, 0, kTangent_m);
}

TEST(PaperTrilateration, T9) {
  expect_at(trilaterate({{{69, 0}, 69}, {{0, 50}, 50}, {{0, 80}, 80}}), FixVerdict::kOk, 0, 0,
            std::sqrt(2 * 4 * kEps * 80));
}

TEST(PaperTrilateration, T13RoundedRanges) {
  // Range 3 is 1.36e-5 short of sqrt(2). Circles 1 and 2 meet at (2, 3) and (3, 2); the others cross it at right
  // angles.
  const Fix fix = trilaterate({{{2, 2}, 1}, {{3, 3}, 1}, {{1, 4}, 1.4142}});
  expect_at(fix, FixVerdict::kOk, 2, 3, 1.4e-5);
}

TEST(PaperTrilateration, T14AFarOriginCostsNothing) {
  const Eigen::Vector2d truth(1.37, 1.21);
  for (const double o : {0.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8}) {
    const Eigen::Vector2d shift(o, o);
    std::vector<LandmarkRange> ranges;
    for (const Eigen::Vector2d& l : {Eigen::Vector2d(0.1, 0.7), {4.3, 0.2}, {0.9, 3.1}}) {
      const Eigen::Vector2d shifted = l + shift;
      // The landmark's place is rounded to the doubles at `o`; the range is to the rounded place.
      ranges.push_back({shifted, ((shifted - shift) - truth).norm()});
    }
    const double spacing_m = std::nextafter(o + 2, kInf) - (o + 2);
    expect_at(trilaterate(ranges), FixVerdict::kOk, o + truth.x(), o + truth.y(), kWell_m + spacing_m);
  }
}

TEST(PaperTrilateration, T16OnALandmark) {
  expect_at(trilaterate({{{0, 0}, 0}, {{4, 0}, 4}, {{0, 3}, 3}}), FixVerdict::kOk, 0, 0, kTangent_m);
}

TEST(PaperTrilateration, T17BadRangesAreLeftOutAndCounted) {
  const Fix fix = trilaterate({{{0, 0}, kNaN},
                               {{0, 0}, std::sqrt(2.0)},
                               {{9, 9}, -1},
                               {{4, 0}, std::sqrt(10.0)},
                               {{7, 7}, kInf},
                               {{0, 3}, std::sqrt(5.0)}});
  expect_at(fix, FixVerdict::kOk, 1, 1, kWell_m);
  EXPECT_EQ(fix.unusable, 3);
  EXPECT_EQ(fix.used, 3);
}

TEST(PaperTrilateration, TakesTheNearestThree) {
  // The two longer ranges are wrong and must not matter.
  expect_at(trilaterate({{{0, 30}, 500},
                         {{0, 0}, std::sqrt(2.0)},
                         {{4, 0}, std::sqrt(10.0)},
                         {{-20, 0}, 400},
                         {{0, 3}, std::sqrt(5.0)}}),
            FixVerdict::kOk, 1, 1, kWell_m);
}

TEST(PaperTrilateration, CirclesThatDoNotMeetUseTheMiddleOfTheGap) {
  // Circles 1 and 2 leave a gap of [1, 1.5] on the line between them; circle 3 is centred above its middle, at (1.25,
  // 2).
  const Fix fix = trilaterate({{{0, 0}, 1}, {{3, 0}, 1.5}, {{1.25, 2}, 2}});
  ASSERT_EQ(fix.verdict, FixVerdict::kGap);
  EXPECT_GT(fix.position_m->x(), 1);
  EXPECT_LT(fix.position_m->x(), 1.5);
  EXPECT_LT(std::abs(fix.position_m->y()), 0.3);
}

TEST(PaperTrilateration, ACircleInsideAnotherUsesTheMiddleOfTheGap) {
  // Circle 2 is inside circle 1; they are nearest to each other at (2, 0) and (2.2, 0).
  const Fix fix = trilaterate({{{0, 0}, 2.2}, {{1, 0}, 1}, {{2.1, 1.5}, 1.5}});
  ASSERT_EQ(fix.verdict, FixVerdict::kGap);
  EXPECT_NEAR(fix.position_m->x(), 2.1, 0.1);
  EXPECT_NEAR(fix.position_m->y(), 0, 0.3);
}

TEST(PaperTrilateration, HasNoAnswerForTooFewOrOnePlace) {
  EXPECT_EQ(trilaterate({}).verdict, FixVerdict::kTooFew);
  EXPECT_EQ(trilaterate({{{0, 0}, 1}, {{1, 0}, 1}}).verdict, FixVerdict::kTooFew);
  const Fix one_place = trilaterate({{{1, 1}, 1}, {{1, 1}, 2}, {{1, 1}, 3}});
  EXPECT_EQ(one_place.verdict, FixVerdict::kTooFew);
  EXPECT_FALSE(one_place.position_m);
}

TEST(PaperTrilateration, IsExactWhereTheRangesAre) {
  std::mt19937_64 random(99);
  std::uniform_real_distribution<double> place(-3, 3);
  int counted = 0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector2d truth(place(random), place(random));
    std::vector<LandmarkRange> ranges;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d l(place(random), place(random));
      ranges.push_back({l, (l - truth).norm()});
    }
    // A corner's condition is 1 / sin of the angle at which its circles cross.
    double least_sine = 1;
    for (const auto& [a, b] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      const Eigen::Vector2d u = (ranges[std::size_t(a)].landmark_m - truth).normalized();
      const Eigen::Vector2d w = (ranges[std::size_t(b)].landmark_m - truth).normalized();
      least_sine = std::min(least_sine, std::abs(u.x() * w.y() - u.y() * w.x()));
    }
    if (least_sine < 0.05) continue;
    ++counted;
    const Fix fix = trilaterate(ranges);
    ASSERT_EQ(fix.verdict, FixVerdict::kOk) << "case " << i;
    EXPECT_LT((*fix.position_m - truth).norm(), 64 * kEps * 6 / least_sine) << "case " << i;
  }
  EXPECT_GT(counted, 2000);
}

}  // namespace
}  // namespace twocone::localisation
