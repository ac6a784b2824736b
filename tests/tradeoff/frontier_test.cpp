// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/sweep.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/special_doubles.h"
#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

std::vector<std::size_t> frontier(const std::vector<CostAndError>& points) { return pareto_frontier(points); }

TEST(ParetoFrontier, IsSortedByRisingCost) {
  EXPECT_THAT(frontier({{3, 1}, {1, 9}, {2, 4}, {2.5, 5}, {9, 1.5}}), ElementsAre(1, 2, 0));
}

TEST(ParetoFrontier, OfNoPointIsEmptyAndOfOnePointThatPoint) {
  EXPECT_THAT(frontier({}), IsEmpty());
  EXPECT_THAT(frontier({{7, 7}}), ElementsAre(0));
}

TEST(ParetoFrontier, OfEqualPointsContainsTheFirst) {
  EXPECT_THAT(frontier({{5, 5}, {2, 3}, {2, 3}, {2, 3}}), ElementsAre(1));
}

TEST(ParetoFrontier, OfEqualCostOrErrorContainsTheBetter) {
  EXPECT_THAT(frontier({{2, 4}, {2, 3}}), ElementsAre(1));
  EXPECT_THAT(frontier({{4, 2}, {3, 2}}), ElementsAre(1));
}

TEST(ParetoFrontier, ContainsOnlyFinitePoints) {
  EXPECT_THAT(frontier({{kNaN, 0}, {0, kNaN}, {-kInf, 0}, {1, -kInf}, {kInf, 1}, {3, 3}}), ElementsAre(5));
  EXPECT_THAT(frontier({{kNaN, kNaN}, {kInf, kInf}}), IsEmpty());
}

TEST(ParetoFrontier, FollowsTheDefinition) {
  std::mt19937_64 engine(31);
  for (int round = 0; round < 50; ++round) {
    std::vector<CostAndError> points;
    // Few different values give many ties.
    for (int i = 0; i < 30; ++i) points.push_back({double(engine() % 7), double(engine() % 7)});
    std::vector<bool> expected(points.size(), true), found(points.size(), false);
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t k = 0; k < points.size(); ++k) {
        const bool no_worse = points[k].cost <= points[i].cost && points[k].error <= points[i].error;
        const bool better = points[k].cost < points[i].cost || points[k].error < points[i].error;
        if (no_worse && (better || k < i)) expected[i] = false;
      }
    }
    for (const std::size_t i : pareto_frontier(points)) found[i] = true;
    EXPECT_EQ(found, expected) << "round " << round;
  }
}

TEST(MarkFrontiers, UsesEitherCostAndLeavesOutSettingsThatSeldomAnswer) {
  const Setting s = usual_setting();
  std::vector<SettingResult> all{
      result_of(s, 0.004, 0.010, 0.1),   // on both frontiers
      result_of(s, 0.002, 0.030, 0.9),   // on the robot's frontier only
      result_of(s, 0.0015, 0.040, 0.3),  // on both frontiers
      result_of(s, 0.0001, 0.001, 0.1),  // answers in only 89 %
      result_of(s, 0.0001, 0.001, 0.1),  // no answer
  };
  all[0].on_robot_frontier = false;
  all[3].answered = 89;
  all[4].answered = 0;
  all[4].position_m.reset();
  all[3].on_robot_frontier = all[3].on_simulation_frontier = true;  // as after an earlier marking
  mark_frontiers(all);
  std::vector<bool> robot, simulation;
  for (const SettingResult& r : all) {
    robot.push_back(r.on_robot_frontier);
    simulation.push_back(r.on_simulation_frontier);
  }
  EXPECT_THAT(robot, ElementsAre(true, true, true, false, false));
  EXPECT_THAT(simulation, ElementsAre(true, false, true, false, false));
  all[3].answered = 90;
  mark_frontiers(all);
  EXPECT_TRUE(all[3].on_robot_frontier);
  EXPECT_FALSE(all[0].on_robot_frontier);
}

}  // namespace
}  // namespace twocone::tradeoff
