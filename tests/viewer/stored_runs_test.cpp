// SPDX-License-Identifier: Apache-2.0
#include "apps/viewer/stored_runs.h"

#include <atomic>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runs/run.h"
#include "drivers/memory/memory.h"
#include "tests/support/memory_robot.h"
#include "tests/support/temporary_folder.h"
#include "tests/viewer/browser.h"

namespace twocone::viewer {
namespace {

using nlohmann::json;

/// Two runs of a robot with cameras in memory.
class StoredRunsTest : public testing::Test {
 protected:
  static constexpr int kFrames = 4;

  void SetUp() override {
    const auto file = folder_.path() / "robot.yaml";
    testing_support::write_memory_robot(file);
    const config::Robot robot = config::read_robot(file);
    for (const char* const name : {"b", "a"}) {
      runs::RunOptions options;
      options.frames = kFrames;
      options.behaviour = "still";
      options.method = estimation::Method::kPaper;
      options.out = folder_.path() / "runs" / name;
      const std::atomic<bool> stop = false;
      const auto driven = runs::run(
          robot, config::read_map(robot.map), options, [](double) {}, stop);
      ASSERT_TRUE(driven) << driven.error().message;
    }
    site_.emplace(find_runs({folder_.path()}));
    const auto address = site_->open({});
    ASSERT_TRUE(address) << address.error().message;
    address_ = web::parse_served(*address);
  }
  web::Reply get(const std::string& target) {
    web::RawClient client(address_);
    client.send(web::request(address_,
                             target + (target.find('?') == std::string::npos ? "?" : "&") + "token=" + address_.token));
    return client.reply().value_or(web::Reply{});
  }

  const testing_support::TemporaryFolder folder_;
  std::optional<StoredRuns> site_;
  web::Address address_;
};

TEST_F(StoredRunsTest, ListsTheRunsInOrder) {
  const json rows = json::parse(get("/runs").body);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0]["name"], "a");
  EXPECT_EQ(rows[1]["name"], "b");
  EXPECT_EQ(rows[1]["run"], 1);
  EXPECT_EQ(rows[0]["frames"], kFrames);
  EXPECT_EQ(rows[0]["behaviour"], "still");
}

TEST_F(StoredRunsTest, SendsTheFramesThatAreRequested) {
  const auto lines_of = [&](const std::string& target) {
    std::vector<json> lines;
    std::istringstream body(get(target).body);
    for (std::string line; std::getline(body, line);) lines.push_back(json::parse(line));
    return lines;
  };
  const auto all = lines_of("/telemetry?run=0");
  ASSERT_EQ(all.size(), 1U + kFrames);
  EXPECT_EQ(all[0]["type"], "run");
  EXPECT_EQ(all[0]["frames_stored"], kFrames);
  const auto part = lines_of("/telemetry?run=1&from=2&count=1");
  ASSERT_EQ(part.size(), 2U);
  EXPECT_EQ(part[1]["frame"], 2);
  EXPECT_EQ(lines_of("/telemetry?run=0&from=99&count=99999").size(), 1U);
}

TEST_F(StoredRunsTest, SendsImagesOfTheRunOnly) {
  const web::Reply image = get("/image?run=0&view=upper&frame=3");
  EXPECT_EQ(image.status, 200);
  EXPECT_EQ(image.body, config::read_text(folder_.path() / "runs/a/upper/000003.png"));
  const auto secret = folder_.path() / "secret";
  std::ofstream(secret) << "secret";
  std::filesystem::create_symlink(secret, folder_.path() / "runs/a/upper/000009.png");
  for (const char* const target :
       {"/image?run=0&view=upper&frame=9", "/image?run=0&view=upper&frame=4", "/image?run=2&view=upper&frame=0",
        "/image?run=0&view=..&frame=0", "/image?run=0&view=upper&frame=-1", "/image?run=0&view=upper&frame=0x1",
        "/image?run=0&view=upper", "/image?view=upper&frame=0", "/image?run=99999999999999999999&view=upper&frame=0",
        "/telemetry", "/telemetry?run=2", "/run.yaml", "/runs/a/run.yaml"}) {
    EXPECT_EQ(get(target).status, 404) << target;
  }
}

TEST_F(StoredRunsTest, ListsAndSendsPointClouds) {
  const auto first_of = [&](int run) {
    const std::string body = get("/telemetry?count=1&run=" + std::to_string(run)).body;
    return json::parse(body.substr(0, body.find('\n')));
  };
  const auto clouds = folder_.path() / "runs/a/clouds";
  std::filesystem::create_directory(clouds);
  for (const char* const name : {"000002.ply", "000000.ply", "notes.txt", "other.ply"}) {
    std::ofstream(clouds / name) << "content of " << name;
  }
  EXPECT_EQ(first_of(0)["clouds"], json({0, 2}));
  EXPECT_FALSE(first_of(1).contains("clouds"));
  EXPECT_EQ(get("/cloud?run=0&frame=2").body, "content of 000002.ply");
  std::ofstream(folder_.path() / "secret") << "secret";
  std::filesystem::create_symlink(folder_.path() / "secret", clouds / "000003.ply");
  for (const char* const target : {"/cloud?run=0&frame=1", "/cloud?run=0&frame=3", "/cloud?run=1&frame=0",
                                   "/cloud?run=0", "/cloud?run=0&frame=x"}) {
    EXPECT_EQ(get(target).status, 404) << target;
  }
}

TEST_F(StoredRunsTest, FindsRunsBelowAFolderAndNothingElse) {
  EXPECT_EQ(find_runs({folder_.path() / "runs/b", folder_.path()}).size(), 3U);
  std::filesystem::create_directory(folder_.path() / "empty");
  EXPECT_THROW(find_runs({folder_.path() / "empty"}), config::FileError);
  EXPECT_THROW(find_runs({folder_.path() / "none"}), config::FileError);
}

}  // namespace
}  // namespace twocone::viewer
