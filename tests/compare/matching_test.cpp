// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/both_runs.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace twocone::compare {
namespace {

using Poses = std::vector<std::optional<runlog::PoseRow>>;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

Pairs pairs_of(const std::vector<Match>& matches) {
  Pairs pairs;
  for (const Match& match : matches) pairs.emplace_back(match.simulated, match.real);
  return pairs;
}

Pairs by_time(const std::vector<double>& simulated, const std::vector<double>& real, double most_apart_s) {
  return pairs_of(match_by_time(simulated, real, most_apart_s));
}

TEST(MatchByTime, TakesTheNearestOnEitherSide) {
  EXPECT_EQ(by_time({0, 1, 2}, {0.4, 0.6, 1.9, 2.3}, 0.5), (Pairs{{0, 0}, {1, 1}, {2, 2}, {2, 3}}))
      << "one may be matched twice";
}

TEST(MatchByTime, OfTwoEquallyNearFramesItIsAlwaysTheSame) {
  // Halves are exact: both are just as near.
  EXPECT_EQ(by_time({0, 1, 2}, {0.5, 1.5}, 0.5), (Pairs{{1, 0}, {2, 1}}));
}

TEST(MatchByTime, BeyondTheLimitThereIsNone) {
  EXPECT_EQ(by_time({1}, {0.5, 0.499, 1.5, 1.501}, 0.5), (Pairs{{0, 0}, {0, 2}})) << "the limit itself is within";
}

TEST(MatchByTime, NothingMatchesNothing) {
  EXPECT_TRUE(by_time({}, {1, 2}, 9).empty());
  EXPECT_TRUE(by_time({1, 2}, {}, 9).empty());
}

TEST(MatchByPose, ARadianCountsAsAMetreTheShortWayRound) {
  EXPECT_DOUBLE_EQ(distance_m({0, 1, 2, 0.5}, {7, 4, 6, 0.5}), 5);
  EXPECT_DOUBLE_EQ(distance_m({0, 0, 0, 0}, {0, 0.3, 0, 0.4}), 0.5);
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(distance_m({0, 0, 0, std::numbers::pi - 0.1}, {0, 0, 0, 0.2 - std::numbers::pi}), 0.3, kRounding);
}

TEST(MatchByPose, NearestWinsAndHeadingsCount) {
  // By position alone the first is nearest; by position and heading the third. The second is the nearest of all, but
  // unknown.
  const Poses simulated{runlog::PoseRow{0, 1.00, 0, 0.2}, std::nullopt, runlog::PoseRow{2, 1.05, 0, 0.01},
                        runlog::PoseRow{3, 0.90, 0, 0}};
  const Poses real{runlog::PoseRow{0, 1.0, 0, 0}, std::nullopt, runlog::PoseRow{0, 5, 0, 0}};
  EXPECT_EQ(pairs_of(match_by_pose(simulated, real, 0.15)), (Pairs{{2, 0}}));
  EXPECT_EQ(pairs_of(match_by_pose(simulated, real, 0.05)), Pairs{}) << "hypot(0.05, 0.01) is beyond";
}

TEST(MatchByPose, OfTwoAtOnePlaceTheFirst) {
  const Poses simulated{runlog::PoseRow{0, 0.1, 0, 0}, runlog::PoseRow{1, -0.1, 0, 0}, runlog::PoseRow{2, -0.1, 0, 0}};
  // The one of least x is tested first; then the run's order decides.
  EXPECT_EQ(pairs_of(match_by_pose(simulated, Poses{runlog::PoseRow{0, -0.2, 0, 0}}, 0.15)), (Pairs{{1, 0}}));
  EXPECT_TRUE(match_by_pose({}, simulated, 1).empty());
  EXPECT_TRUE(match_by_pose(simulated, {}, 1).empty());
}

TEST(WhyOtherRooms, RoomsAreDistinguishedByTheirLandmarks) {
  const config::Map lab = config::read_map(TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml");
  const config::Map hall = config::read_map(TWOCONE_SOURCE_DIR "/scenes/hall.map.yaml");
  const config::Map workshop = config::read_map(TWOCONE_SOURCE_DIR "/scenes/workshop.map.yaml");
  EXPECT_NE(why_other_rooms(lab, hall), "");
  EXPECT_NE(why_other_rooms(hall, lab), "");
  EXPECT_NE(why_other_rooms(workshop, lab), "");
  EXPECT_NE(why_other_rooms(workshop, hall), "");
  EXPECT_EQ(why_other_rooms(lab, lab), "");
  config::Map alone = lab;
  for (config::Landmark& landmark : alone.landmarks) landmark.name += "_of_another";
  EXPECT_EQ(why_other_rooms(lab, alone), "their maps have no landmark of the same name");
}

TEST(WhyOtherRooms, AnotherOriginAMovedAndAMissingLandmarkAreOfOneRoom) {
  const config::Map lab = config::read_map(TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml");
  config::Map other = lab;
  constexpr double kTurn_rad = 0.77;
  for (config::Landmark& landmark : other.landmarks) {
    const double x_m = landmark.x_m, y_m = landmark.y_m;
    landmark.x_m = std::cos(kTurn_rad) * x_m - std::sin(kTurn_rad) * y_m + 13.1;
    landmark.y_m = std::sin(kTurn_rad) * x_m + std::cos(kTurn_rad) * y_m - 4.2;
  }
  EXPECT_EQ(why_other_rooms(lab, other), "");
  other.landmarks[2].x_m += 1.7;
  EXPECT_EQ(why_other_rooms(lab, other), "") << "a landmark that was moved is what a comparison finds";
  other.landmarks.pop_back();
  EXPECT_EQ(why_other_rooms(lab, other), "");
  EXPECT_EQ(why_other_rooms(other, lab), "");
}

// Rounding of sums of a dozen doubles, and of exp and lgamma of numbers below 100.
constexpr double kTimingRounding = 1e-12;

runlog::RunData run_at(const std::vector<double>& times_s, const std::string& driver) {
  runlog::RunData run;
  run.robot.drive.driver = run.robot.lower.driver = run.robot.upper.driver = driver;
  for (const double t_s : times_s) {
    runlog::FrameRow row;
    row.frame = row.lower_sequence = row.upper_sequence = run.frames.size();
    row.t_s = row.lower_t_s = row.upper_t_s = t_s;
    run.frames.push_back(row);
  }
  return run;
}

TEST(Timing, RateIsThatOfTheMedianStepAndJitterItsScatter) {
  // Steps 100, 110, 90, 100, 100 ms.
  const Timing timing = timing_of(run_at({0, 0.1, 0.21, 0.3, 0.4, 0.5}, "memory"));
  EXPECT_NEAR(timing.rate_hz, 10, 1e-9);
  EXPECT_NEAR(timing.jitter_s, std::sqrt(2e-4 / 5), kTimingRounding);
  EXPECT_EQ(timing.all, (std::array<std::uint64_t, 2>{6, 6}));
  EXPECT_EQ(timing.lost, (std::array<std::uint64_t, 2>{0, 0}));
  EXPECT_FALSE(timing.ageing_s) << "there is no clock of the machine";
}

TEST(Timing, PeriodsWithALossDoNotCount) {
  runlog::RunData run = run_at({0, 0.1, 0.4, 0.5}, "memory");
  run.frames[2].lower_sequence = 4, run.frames[2].upper_sequence = 4;
  run.frames[3].lower_sequence = 5, run.frames[3].upper_sequence = 5;
  run.frames[2].lower_lost = 2, run.frames[2].upper_lost = 2;
  run.frames[0].upper_lost = 3;
  const Timing timing = timing_of(run);
  EXPECT_NEAR(timing.rate_hz, 10, 1e-9);
  EXPECT_NEAR(timing.jitter_s, 0, kTimingRounding);
  EXPECT_EQ(timing.lost, (std::array<std::uint64_t, 2>{2, 5}));
  EXPECT_EQ(timing.all, (std::array<std::uint64_t, 2>{6, 9}));
}

TEST(Timing, WhereNoTwoFramesFollowTheRateIsUnknown) {
  runlog::RunData run = run_at({0, 0.1, 0.2}, "memory");
  for (std::size_t i = 0; i < 3; ++i) run.frames[i].upper_sequence = 3 * i;
  EXPECT_EQ(timing_of(run).rate_hz, 0);
}

TEST(Timing, SkewIsThatOfTheStampsUpperLessLower) {
  runlog::RunData run = run_at({0, 0.1, 0.2, 0.3}, "memory");
  const double skews_s[]{0.002, -0.004, 0.003, 0.003};
  for (std::size_t i = 0; i < 4; ++i) {
    run.frames[i].upper_t_s += skews_s[i];
    run.frames[i].skew_s = skews_s[i];
  }
  const Timing timing = timing_of(run);
  EXPECT_NEAR(timing.skew_s, 0.001, kTimingRounding);
  EXPECT_NEAR(timing.most_skew_s, 0.004, kTimingRounding);
  // Squared deviations: 1 + 25 + 4 + 4 = 34 ms^2; the root of their mean over the root of four.
  EXPECT_NEAR(timing.skew_sigma_s, std::sqrt(34e-6 / 4) / 2, kTimingRounding);
}

TEST(Timing, AgeingImagesAreReportedForARealRobotOnly) {
  for (const bool is_simulated : {false, true}) {
    runlog::RunData run = run_at({0, 0.1, 0.2}, is_simulated ? "sim_povray" : "memory");
    run.frames.front().host_t_s = 0.05;
    run.frames.back().host_t_s = 0.29;  // 90 ms behind the stamp, 50 at first
    const auto ageing_s = timing_of(run).ageing_s;
    ASSERT_EQ(ageing_s.has_value(), !is_simulated);
    EXPECT_NEAR(ageing_s.value_or(0.04), 0.04, kTimingRounding);
  }
}

TEST(LostPValue, IsTheExactBinomialTestOfBothSides) {
  // 3 of 10 at a half: P(k) = C(10, k) / 1024; as improbable or more are k <= 3 and k >= 7: 2 (1 + 10 + 45 + 120).
  EXPECT_NEAR(lost_p_value(3, 10, 0.5), 352.0 / 1024, kTimingRounding);
  EXPECT_NEAR(lost_p_value(5, 10, 0.5), 1, kTimingRounding) << "the most probable number, so all count";
  // 2 of 3 at a quarter: P = 27, 27, 9, 1 of 64; so 9 + 1.
  EXPECT_NEAR(lost_p_value(2, 3, 0.25), 10.0 / 64, kTimingRounding);
  // 0 and 1 of 3 are equally probable: all count.
  EXPECT_NEAR(lost_p_value(0, 3, 0.25), 1, kTimingRounding);
  EXPECT_NEAR(lost_p_value(3, 3, 0.25), 1.0 / 64, kTimingRounding);
}

TEST(LostPValue, AtProbabilitiesZeroAndOneNothingIsRandom) {
  EXPECT_EQ(lost_p_value(0, 9, 0.0), 1);
  EXPECT_EQ(lost_p_value(1, 9, 0.0), 0);
  EXPECT_EQ(lost_p_value(9, 9, 1.0), 1);
  EXPECT_EQ(lost_p_value(8, 9, 1.0), 0);
}

TEST(LostPValue, IsFishersExactTestForTwoCameras) {
  // Lost 1 of 4 and 3 of 4: 4 lost of 8. P(k of the first) = C(4, k) C(4, 4 - k) / C(8, 4) = 1, 16, 36, 16, 1 of 70.
  EXPECT_NEAR(lost_p_value(1, 4, 3, 4), 34.0 / 70, kTimingRounding);
  EXPECT_NEAR(lost_p_value(0, 4, 4, 4), 2.0 / 70, kTimingRounding) << "none and all";
  EXPECT_NEAR(lost_p_value(4, 4, 0, 4), 2.0 / 70, kTimingRounding);
  // Lost 2 of 3 and 0 of 5: P(k) = C(3, k) C(5, 2 - k) / C(8, 2) = 10, 15, 3 of 28.
  EXPECT_NEAR(lost_p_value(2, 3, 0, 5), 3.0 / 28, kTimingRounding) << "unequal numbers of frames";
  EXPECT_NEAR(lost_p_value(0, 5, 2, 3), 3.0 / 28, kTimingRounding) << "whichever comes first";
}

TEST(LostPValue, EqualLossesOfNoneOrAllAreNoDifference) {
  EXPECT_NEAR(lost_p_value(0, 4, 0, 7), 1, kTimingRounding);
  EXPECT_NEAR(lost_p_value(4, 4, 7, 7), 1, kTimingRounding);
  EXPECT_NEAR(lost_p_value(0, 100'000, 0, 50'000), 1, 1e-6) << "logarithms of factorials of a million";
}

}  // namespace
}  // namespace twocone::compare
