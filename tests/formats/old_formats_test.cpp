// SPDX-License-Identifier: Apache-2.0
// Files of versions 0.1 and 1.0, which are read for ever (docs/compatibility.md). The names of 0.1 are never written
// (apps/config/yaml/names.h); those of 1.0 always are.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/yaml/names.h"
#include "apps/estimation/method.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/tables/tables.h"
#include "apps/telemetry/telemetry.h"
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

// ---- version 1.0

std::filesystem::path file_of_1_0(const std::string& name) {
  return std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/formats/v1_0" / name;
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns the paths of an object's values that another has not. Of lists only the first elements are compared.
std::vector<std::string> keys_that_are_gone(const nlohmann::json& before, const nlohmann::json& now,
                                            const std::string& path = "") {
  std::vector<std::string> gone;
  const auto compare = [&](const nlohmann::json& b, const nlohmann::json& n, const std::string& name) {
    const auto inside = keys_that_are_gone(b, n, path + "/" + name);
    gone.insert(gone.end(), inside.begin(), inside.end());
  };
  if (before.is_object()) {
    for (const auto& [key, value] : before.items()) {
      if (!now.is_object() || !now.contains(key)) {
        gone.push_back(path + "/" + key);
      } else {
        compare(value, now[key], key);
      }
    }
  } else if (before.is_array() && now.is_array() && !before.empty() && !now.empty()) {
    compare(before[0], now[0], "0");
  }
  return gone;
}

TEST(FilesOf1_0, RobotAndMapAreRead) {
  const config::Robot robot = config::read_robot(file_of_1_0("robot.yaml"));
  EXPECT_EQ(robot.name, "lab");
  EXPECT_EQ(config::read_map(robot.map).landmarks.size(), 6U);
}

TEST(FilesOf1_0, ARunFolderIsRead) {
  const runlog::RunData run = runlog::read_run(file_of_1_0("run"));
  EXPECT_EQ(run.info.version, "1.0.0");
  EXPECT_EQ(run.method, "outline");
  EXPECT_EQ(run.frames.size(), 3U);
  EXPECT_EQ(run.ranges.size(), 18U);
  EXPECT_EQ(run.fixes.size(), 3U);
  EXPECT_EQ(run.truth.size(), 3U);
  EXPECT_EQ(run.track.size(), 3U);
  EXPECT_FALSE(run.sightings.empty());
  EXPECT_EQ(runlog::read_run(file_of_1_0("run"), "paper").fixes.size(), 3U);
}

template <typename Row>
void expect_columns(const std::string& file) {
  const auto now = runlog::split_fields(runlog::TableReader<Row>::header());
  const std::string content = content_of(file_of_1_0("run/" + file));
  for (const std::string& column : runlog::split_fields(content.substr(0, content.find('\n')))) {
    EXPECT_THAT(now, testing::Contains(column)) << file;
  }
}

TEST(FilesOf1_0, TheirColumnsAreStillWritten) {
  expect_columns<runlog::FrameRow>("frames.csv");
  expect_columns<runlog::DriveRow>("drive.csv");
  expect_columns<runlog::RangeRow>("ranges.csv");
  expect_columns<runlog::FixRow>("fixes.csv");
  expect_columns<runlog::SightingRow>("sightings.csv");
  expect_columns<runlog::TrackRow>("track.csv");
  expect_columns<runlog::TimingRow>("timing.csv");
}

TEST(FilesOf1_0, TheKeysOfSummaryAndTelemetryAreStillWritten) {
  const runlog::RunData run = runlog::read_run(file_of_1_0("run"));
  const auto summary = nlohmann::json::parse(content_of(file_of_1_0("run/summary.json")));
  const auto now = nlohmann::json::parse(runlog::to_json(runlog::summarise(run), run.info));
  EXPECT_THAT(keys_that_are_gone(summary, now), testing::IsEmpty());

  const telemetry::StoredRun stored(run);
  std::istringstream lines(content_of(file_of_1_0("run/telemetry.jsonl")));
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_THAT(keys_that_are_gone(nlohmann::json::parse(line), nlohmann::json(stored.run())), testing::IsEmpty());
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_THAT(keys_that_are_gone(nlohmann::json::parse(line), nlohmann::json(stored.frame(i))), testing::IsEmpty());
  }
}

}  // namespace
}  // namespace twocone
