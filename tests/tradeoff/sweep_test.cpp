// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/run_shards.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/special_doubles.h"
#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;
using twocone::testing_support::kInf;
using twocone::testing_support::kNaN;

constexpr double kSumDigits = 1e-12;  ///< a few additions of numbers below 1000

/// Three settings: two of the same images, of which the second fuses two frames, and one of other images.
Plan three_settings() {
  Plan plan;
  Setting fused = usual_setting(), small = usual_setting();
  fused.frames = 2;
  small.images = {320, 240, 2, Effects::kScene};
  plan.settings = {usual_setting(), fused, small};
  return plan;
}

FrameRow row(int setting, int episode, int step, std::optional<double> error_m, double vision_s) {
  return {.setting = setting,
          .episode = episode,
          .step = step,
          .verdict = error_m ? "ok" : "too_few",
          .error_m = error_m,
          .vision_s = vision_s,
          .localisation_s = 0.5};
}

TEST(Merge, GroupsErrorsByEpisode) {
  ShardRecord all;
  // The rows are in the order in which shards end.
  all.frames = {row(0, 2, 0, 0.005, 1), row(0, 0, 0, 0.001, 2), row(0, 0, 1, 0.003, 3), row(0, 1, 0, std::nullopt, 4),
                row(0, 3, 1, 0.004, 5)};
  const Check check = check_of(three_settings(), all, 0);
  const ByEpisode& errors = check.position_errors_m;
  EXPECT_THAT(errors, ElementsAre(ElementsAre(0.001, 0.003), IsEmpty(), ElementsAre(0.005), ElementsAre(0.004)));
  EXPECT_THAT(check.robot_times_s,
              ElementsAre(ElementsAre(2.5, 3.5), ElementsAre(4.5), ElementsAre(1.5), ElementsAre(5.5)));
  EXPECT_EQ(check.answered_share, 0.8);
  EXPECT_THAT(check_of(three_settings(), all, 1).position_errors_m, IsEmpty());

  const SettingResult r = merge(three_settings(), all).settings[0];
  EXPECT_EQ(r.frames, 5);
  EXPECT_EQ(r.answered, 4);
  EXPECT_EQ(r.answered_share(), 0.8);
  ASSERT_TRUE(r.position_m);
  EXPECT_EQ(r.position_m->max, 0.005);
  EXPECT_NEAR(r.position_m->mean.value, 0.013 / 4, kSumDigits);
  EXPECT_EQ(r.position_m->mean.high, mean_interval(errors, 0.95).high);
  EXPECT_NEAR(r.position_m->rmse.value, std::sqrt((1 + 9 + 25 + 16) / 4.0) / 1000, kSumDigits);
  EXPECT_EQ(r.position_m->p95.value, 0.005);
  // No row has a heading, a range, a covariance or a bound.
  EXPECT_FALSE(r.heading_rad || r.range_m || r.coverage || r.bound_m);
}

TEST(Merge, TimesAreOfAllFramesAndVisionWithLocalisationOfEach) {
  ShardRecord all;
  all.frames = {row(0, 0, 0, 0.001, 4), row(0, 1, 0, 0.001, 1), row(0, 2, 0, 0.001, 3), row(0, 3, 0, 0.001, 2)};
  all.frames[0].localisation_s = 1;
  all.frames[1].localisation_s = 6;
  const SettingResult r = merge(three_settings(), all).settings[0];
  EXPECT_EQ(r.vision.median_s.value, 2);
  EXPECT_EQ(r.vision.spread_s, 3 - 1);
  EXPECT_EQ(r.vision.p95_s.value, 4);
  EXPECT_EQ(r.localisation.p95_s.value, 6);
  EXPECT_EQ(r.robot.p95_s.value, 7);  // 1 + 6, not 4 + 6
  EXPECT_EQ(r.robot_time_s().high,
            quantile_interval(check_of(three_settings(), all, 0).robot_times_s, 0.95, 0.95).high);
}

TEST(Merge, IntermediateFramesCountForTimesOnly) {
  ShardRecord all;
  for (int episode = 0; episode < 4; ++episode) {
    FrameRow on_the_way = row(1, episode, 0, std::nullopt, 8);
    on_the_way.verdict.clear();
    on_the_way.bound_m = 99;
    all.frames.push_back(on_the_way);
    all.frames.push_back(row(1, episode, 1, 0.002, 1));
    all.frames.back().bound_m = episode == 0 ? 0.003 : 0.004;
  }
  const SettingResult r = merge(three_settings(), all).settings[1];
  EXPECT_EQ(r.frames, 4);
  EXPECT_EQ(r.answered, 4);
  EXPECT_EQ(r.vision.p95_s.value, 8);
  EXPECT_EQ(r.vision.median_s.value, 1);
  ASSERT_TRUE(r.bound_m);
  EXPECT_NEAR(*r.bound_m, std::sqrt((9 + 3 * 16) / 4.0) / 1000, kSumDigits);
}

TEST(Merge, RenderingIsThatOfTheImages) {
  ShardRecord all;
  for (int episode = 0; episode < 3; ++episode) {
    for (int setting = 0; setting < 3; ++setting) all.frames.push_back(row(setting, episode, 0, 0.001, 1));
    all.renders.push_back({.setting = 0, .episode = episode, .step = 0, .cpu_s = 2.0 + episode});
    all.renders.push_back({.setting = 2, .episode = episode, .step = 0, .cpu_s = 0.5});
  }
  all.memory = {{0, 100}, {0, 300}, {0, 200}, {1, 50}};
  all.render_memory = {{0, 7000}, {0, 6000}, {2, 900}};
  const auto settings = merge(three_settings(), all).settings;
  EXPECT_EQ(settings[0].render_cpu.median_s.value, 3);
  EXPECT_EQ(settings[1].render_cpu.median_s.value, 3);
  EXPECT_EQ(settings[2].render_cpu.median_s.value, 0.5);
  EXPECT_EQ(settings[0].peak_bytes, 300);
  EXPECT_EQ(settings[1].peak_bytes, 50);
  EXPECT_EQ(settings[2].peak_bytes, 0);
  EXPECT_EQ(settings[0].render_bytes, 7000);
  EXPECT_EQ(settings[1].render_bytes, 7000);
  EXPECT_EQ(settings[2].render_bytes, 900);
  EXPECT_EQ(settings[0].simulation_time_s().value, 1.5 + 3);
  // Marked are the first of those with equal errors and robot times, and the one with cheap images.
  EXPECT_TRUE(settings[0].on_robot_frontier);
  EXPECT_FALSE(settings[1].on_robot_frontier || settings[2].on_robot_frontier);
  EXPECT_TRUE(settings[2].on_simulation_frontier);
  EXPECT_FALSE(settings[0].on_simulation_frontier || settings[1].on_simulation_frontier);
}

TEST(Merge, HeadingsRangesAndCoverage) {
  ShardRecord all;
  for (int episode = 0; episode < 5; ++episode) {
    all.frames.push_back(row(2, episode, 0, 0.001, 1));
    all.frames.back().heading_error_rad = 0.01 * episode;
    if (episode > 0) all.frames.back().in_ellipse = episode != 3;
    all.ranges.push_back({.setting = 2, .episode = episode, .step = 0, .error_m = 0.02});
    all.ranges.push_back({.setting = 2, .episode = episode, .step = 0, .error_m = 0.04});
  }
  const SettingResult r = merge(three_settings(), all).settings[2];
  ASSERT_TRUE(r.heading_rad && r.range_m && r.coverage);
  EXPECT_NEAR(r.heading_rad->mean.value, 0.02, kSumDigits);
  EXPECT_NEAR(r.range_m->mean.value, 0.03, kSumDigits);
  EXPECT_EQ(r.coverage->value, 0.75);
}

TEST(Merge, OfASettingWithoutRowsHasNoFigures) {
  const SettingResult r = merge(three_settings(), {}).settings[2];
  EXPECT_EQ(r.setting, three_settings().settings[2]);
  EXPECT_EQ(r.frames, 0);
  EXPECT_FALSE(r.position_m || r.on_robot_frontier);
}

TEST(Merge, RejectsRowsThatAreNotInThePlan) {
  const auto rejects = [](const ShardRecord& all, const char* text) {
    EXPECT_THAT([&] { merge(three_settings(), all); }, ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
  };
  ShardRecord all;
  all.frames = {row(3, 0, 0, 0.001, 1)};
  rejects(all, "of setting 3, but the plan has 0 to 2");
  all = {};
  all.memory = {{-1, 100}};
  rejects(all, "of setting -1");
  all = {};
  all.frames = {row(0, -2, 0, 0.001, 1)};
  rejects(all, "episode is -2, must be >= 0");
  all.frames = {row(0, 0, 0, kNaN, 1)};
  rejects(all, "must be finite and >= 0");
}

// ---- frontiers

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
