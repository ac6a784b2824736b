// SPDX-License-Identifier: Apache-2.0
// Files of version 0.1, which are read for ever and never written (apps/config/yaml/names.h).
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/yaml/names.h"
#include "apps/estimation/method.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"
#include "apps/tradeoff/shard.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"
#include "tests/tradeoff/lab.h"

namespace twocone {
namespace {

using testing::HasSubstr;
using testing::Not;

std::filesystem::path old_file(const std::string& name) {
  return std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/formats/v0_1" / name;
}

TEST(OldFormats, ARobotFileIsReadWithThePresentNames) {
  const config::Robot robot = config::read_robot(old_file("robot.yaml"));
  EXPECT_EQ(robot.estimator.method, "outline");
  EXPECT_EQ(robot.lower.effects.exposure_time_s, 0.02);
  EXPECT_EQ(robot.lower.effects.shutter_samples, 2);
}

// Catches old names that come back in run.yaml or in a file that calibrate writes.
TEST(OldFormats, ARobotFileIsWrittenWithThePresentNames) {
  const YAML::Node node = config::load_robot_node(config::read_robot(old_file("robot.yaml")));
  YAML::Emitter out;
  out << node;
  EXPECT_THAT(out.c_str(), HasSubstr("shutter_samples: 2"));
  EXPECT_THAT(out.c_str(), HasSubstr("exposure_time_s: 0.02"));
  EXPECT_THAT(out.c_str(), HasSubstr("method: outline"));
  EXPECT_THAT(out.c_str(), Not(HasSubstr("exposures")));
  EXPECT_THAT(out.c_str(), Not(HasSubstr("exposure_s:")));
}

TEST(OldFormats, AKeyUnderBothNamesIsRefused) {
  const twocone::testing_support::TemporaryFolder folder;
  std::ifstream in(old_file("robot.yaml"));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  text.replace(text.find("exposures: 2"), 12, "exposures: 2, shutter_samples: 2");
  const std::filesystem::path file = folder.path() / "robot.yaml";
  std::ofstream(file) << text;
  EXPECT_THAT(testing_support::error_of<std::runtime_error>([&] { config::read_robot(file); }),
              HasSubstr("robot.yaml:23: effects.camera.exposures is unknown"));
}

TEST(OldFormats, AMapIsRead) {
  const config::Map map = config::read_map(old_file("map.yaml"));
  EXPECT_EQ(map.landmarks.size(), 6U);
  EXPECT_EQ(map.moving.size(), 1U);
}

TEST(OldFormats, ARunFolderIsReadWithBothItsMethods) {
  const runlog::RunData run = runlog::read_run(old_file("run"));
  EXPECT_EQ(run.info.method, "outline");
  EXPECT_EQ(run.method, "outline");
  ASSERT_EQ(run.frames.size(), 3U);
  EXPECT_EQ(run.ranges.size(), 18U);
  ASSERT_EQ(run.timing.size(), 3U) << "its effort.csv";
  EXPECT_EQ(run.timing[1].refined, 4);
  const auto timing = runlog::summarise_timing(run);
  ASSERT_TRUE(timing);
  EXPECT_EQ(timing->kept, 3);
  const runlog::RunData outline = runlog::read_run(old_file("run"), "outline");
  EXPECT_EQ(outline.ranges.size(), run.ranges.size()) << "its methods/full";
  EXPECT_EQ(outline.ranges[0].range_m, run.ranges[0].range_m);
  EXPECT_EQ(runlog::read_run(old_file("run"), "paper").fixes.size(), 3U);
}

TEST(OldFormats, AShardOfASweepIsRead) {
  const twocone::testing_support::TemporaryFolder folder;
  const tradeoff::Lab lab;
  tradeoff::Plan plan = tradeoff::make_plan(lab.robot, lab.map, {.episodes = 3});
  plan.shards.resize(1);
  const tradeoff::SweepFolder sweep(folder.path(), lab.robot, lab.map, plan);
  std::filesystem::copy(old_file("sweep/shards/0000"), folder.path() / "shards/0000");
  const tradeoff::ShardRecord record = sweep.read_all();
  ASSERT_FALSE(record.frames.empty());
  EXPECT_EQ(record.frames[1].episode, 0);
  EXPECT_EQ(record.frames[1].step, 1);
  EXPECT_EQ(record.frames[0].verdict, "ok");
  EXPECT_FALSE(record.ranges.empty());
  EXPECT_FALSE(record.renders.empty());
}

TEST(OldFormats, AnOldMethodOnTheCommandLineNamesThePresentOne) {
  EXPECT_EQ(testing_support::error_of<std::invalid_argument>([] { (void)estimation::method_named("full"); }),
            "method 'full' is now named 'outline'");
  EXPECT_EQ(config::present_name(config::NameOf::kOption, "--legs"), "--episodes");
  EXPECT_EQ(config::present_name(config::NameOf::kOption, "--frames"), "--frames");
  EXPECT_EQ(config::present_columns("setting,leg,instant,error_m"), "setting,episode,step,error_m");
}

}  // namespace
}  // namespace twocone
