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

}  // namespace
}  // namespace twocone::compare
