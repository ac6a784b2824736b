// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/plan.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "localisation/odometry.h"
#include "tests/tradeoff/lab.h"

namespace twocone::tradeoff {
namespace {

Setting own_setting(const Plan& plan) {
  return *std::find_if(plan.settings.begin(), plan.settings.end(), [](const Setting& s) {
    return s.images == Images{640, 480, 1, Effects::kScene} && s.level == Level::kFine && s.frames == 1 &&
           s.landmarks == 6;
  });
}

TEST(Plan, OfTheLabHasTheRequestedSettingsAndNothingTwice) {
  const Lab lab;
  const Plan plan = make_plan(lab.robot, lab.map, {});
  EXPECT_GE(plan.settings.size(), 60U);
  const std::set<Setting> different(plan.settings.begin(), plan.settings.end());
  EXPECT_EQ(different.size(), plan.settings.size());
  for (const Axis axis : kAllAxes) {
    std::set<std::string> values;
    for (const Setting& setting : plan.settings) values.insert(facts_of(axis).value(setting));
    EXPECT_GE(values.size(), 2U) << facts_of(axis).name;
  }
}

TEST(Plan, EachSettingsImagesAreInShardsOnce) {
  const Lab lab;
  const Plan plan = make_plan(lab.robot, lab.map, {.episodes = 9});
  for (const Setting& setting : plan.settings) {
    std::vector<int> episodes;
    for (const Plan::Shard& shard : plan.shards) {
      if (shard.images != setting.images) continue;
      for (int i = 0; i < shard.episodes; ++i) episodes.push_back(shard.first_episode + i);
    }
    ASSERT_GE(episodes.size(), 3U) << describe(setting);
    for (std::size_t i = 0; i < episodes.size(); ++i) EXPECT_EQ(episodes[i], int(i)) << describe(setting);
    EXPECT_LE(episodes.size(), plan.episodes.size());
  }
}

TEST(Plan, EpisodesAreFreeOfObstaclesAndDependOnTheSeedOnly) {
  const Lab lab;
  const behaviours::Arena arena = config::to_arena(lab.map);
  const Plan plan = make_plan(lab.robot, lab.map, {.seed = 7});
  const Plan longer = make_plan(lab.robot, lab.map, {.seed = 7, .episodes = 30});
  const Plan other = make_plan(lab.robot, lab.map, {.seed = 8});
  for (std::size_t i = 0; i < plan.episodes.size(); ++i) {
    const Episode& episode = plan.episodes[i];
    EXPECT_EQ(episode.seed, longer.episodes[i].seed);
    EXPECT_EQ(episode.from.x_m, longer.episodes[i].from.x_m);
    EXPECT_NE(episode.seed, other.episodes[i].seed);
    localisation::Pose pose{episode.from.x_m, episode.from.y_m, episode.from.heading_rad};
    for (int k = 0; k < kStepsOfEpisode; ++k) {
      EXPECT_GT(arena.clearance_m({pose.x_m, pose.y_m}), lab.robot.body_radius_m) << "episode " << i << ", step " << k;
      const double way = lab.robot.drive.wheel_radius_m / lab.robot.lower.settings.rate_hz;
      pose = localisation::drive_arc(pose, episode.speeds.left_radps * way, episode.speeds.right_radps * way,
                                     lab.robot.drive.wheel_separation_m);
    }
  }
}

TEST(Plan, ACheckUsesItsOwnPoses) {
  const Lab lab;
  const Plan plan = make_plan(lab.robot, lab.map, {});
  const Images& images = own_setting(plan).images;
  const Plan check = make_check_plan(lab.robot, lab.map, plan, images, 40);
  EXPECT_NE(std::find(check.settings.begin(), check.settings.end(), own_setting(plan)), check.settings.end());
  for (const Setting& setting : check.settings) EXPECT_EQ(setting.images, images) << describe(setting);
  ASSERT_EQ(check.episodes.size(), 40U);
  for (const Episode& episode : check.episodes) {
    for (const Episode& used : plan.episodes) {
      EXPECT_FALSE(episode.from.x_m == used.from.x_m && episode.from.y_m == used.from.y_m);
      EXPECT_NE(episode.seed, used.seed);
    }
  }
}

TEST(Plan, LandmarksAreRankedAndComplete) {
  const Lab lab;
  const Plan plan = make_plan(lab.robot, lab.map, {});
  ASSERT_EQ(plan.landmarks.size(), lab.map.landmarks.size());
  EXPECT_EQ(std::set<std::string>(plan.landmarks.begin(), plan.landmarks.end()).size(), plan.landmarks.size());
}

TEST(Plan, StepsFollowTheRate) {
  Setting setting;
  setting.rate_hz = 15;
  EXPECT_EQ(steps_of(setting, 15), (std::vector<int>{3}));
  setting.frames = 4;
  EXPECT_EQ(steps_of(setting, 15), (std::vector<int>{0, 1, 2, 3}));
  setting.frames = 2;
  setting.rate_hz = 5;
  EXPECT_EQ(steps_of(setting, 15), (std::vector<int>{0, 3}));
}

TEST(Plan, RejectsWhatCannotBeSwept) {
  Lab lab;
  EXPECT_THROW(make_plan(lab.robot, lab.map, {.episodes = 2}), std::invalid_argument);
  config::Map few = lab.map;
  few.landmarks.resize(2);
  EXPECT_THROW(make_plan(lab.robot, few, {}), config::FileError);
  config::Robot attached = lab.robot;
  attached.attach = "hall";
  EXPECT_THROW(make_plan(attached, lab.map, {}), config::FileError);
  config::Robot huge = lab.robot;
  huge.body_radius_m = 3;
  EXPECT_THROW(make_plan(huge, lab.map, {}), config::FileError);
}

TEST(Setting, RobotOfScalesImagesAndRigAlike) {
  const Lab lab;
  Setting setting = own_setting(make_plan(lab.robot, lab.map, {}));
  EXPECT_EQ(robot_of(setting, lab.robot, {}).rig, lab.robot.rig);
  setting.images = {320, 240, 2, Effects::kNoise};
  setting.level = Level::kAdaptive;
  setting.enough_m = 0.002;
  setting.landmarks = 3;
  setting.rate_hz = 5;
  const std::vector<std::string> names{"blue", "red", "cyan", "green", "magenta", "yellow"};
  const config::Robot robot = robot_of(setting, lab.robot, names);
  EXPECT_EQ(robot.lower.settings.width_px, 320);
  EXPECT_EQ(robot.upper.settings.height_px, 240);
  EXPECT_EQ(robot.lower.antialias, 2);
  EXPECT_EQ(robot.upper.settings.rate_hz, 5);
  EXPECT_EQ(robot.lower.effects.full_well_electrons, kNoiseElectrons);
  // The middle of the image stays its middle: (w - 1) / 2.
  EXPECT_DOUBLE_EQ(robot.rig.lower.centre_px[0], 159.5);
  EXPECT_DOUBLE_EQ(robot.rig.upper.centre_px[1], 119.5);
  EXPECT_DOUBLE_EQ(robot.rig.lower.rim_radius_px, 118);
  EXPECT_EQ(robot.estimator.stage, "adaptive");
  EXPECT_EQ(robot.estimator.enough_m, 0.002);
  EXPECT_EQ(robot.estimator.landmarks, (std::vector<std::string>{"blue", "red", "cyan"}));
}

}  // namespace
}  // namespace twocone::tradeoff
