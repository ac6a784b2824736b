// SPDX-License-Identifier: Apache-2.0
#include "apps/scan/scan.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runs/run.h"
#include "tests/support/temporary_folder.h"

namespace twocone::scan {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kFrames = 3;

/// A short drive of the scout in the study. Each test changes a copy of it.
class ScanOfARun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new testing_support::TemporaryFolder;
    const config::Robot robot = config::read_robot(fs::path(TWOCONE_SOURCE_DIR) / "robots/scout_sim.yaml");
    runs::RunOptions options;
    options.frames = kFrames;
    options.out = folder_->path() / "run";
    options.renderer = sim_povray::RendererKind::kNative;
    const std::atomic<bool> never = false;
    const auto driven = runs::run(
        robot, config::read_map(robot.map), options, [](double) {}, never);
    ASSERT_TRUE(driven) << driven.error().message;
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  [[nodiscard]] fs::path copy() const {
    fs::path to = own_.path() / "run";
    fs::copy(folder_->path() / "run", to, fs::copy_options::recursive);
    return to;
  }

  static inline testing_support::TemporaryFolder* folder_ = nullptr;
  testing_support::TemporaryFolder own_;
};

struct Row {
  int frame;
  double beam_rad;
  std::string state;
  double range_m, sigma_m;
};
std::vector<Row> rows_of(const fs::path& run) {
  std::istringstream lines(config::read_text(scan_file(run)));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "frame,t_s,beam_rad,state,range_m,sigma_m");
  std::vector<Row> rows;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::vector<std::string> field(6);
    for (std::string& each : field) std::getline(fields, each, ',');
    const auto number = [](const std::string& text) { return text.empty() ? NAN : std::stod(text); };
    rows.push_back({std::stoi(field[0]), std::stod(field[2]), field[3], number(field[4]), number(field[5])});
  }
  return rows;
}

TEST_F(ScanOfARun, ShowsTheWallsAndThingsOfTheMapWhereTheyAre) {
  const fs::path run = copy();
  const auto counts = scan(run, {});
  ASSERT_TRUE(counts) << counts.error().message;
  EXPECT_EQ(counts->frames, kFrames);
  const std::vector<Row> rows = rows_of(run);
  ASSERT_EQ(rows.size(), std::size_t(kFrames) * 360);
  const runlog::RunData data = runlog::read_run(run);
  const behaviours::Arena arena = config::to_arena(data.map);
  int occupied = 0;
  int there = 0;
  for (const Row& row : rows) {
    if (row.state == "unknown") {
      EXPECT_TRUE(std::isnan(row.range_m));
      continue;
    }
    ASSERT_GT(row.range_m, 0);
    if (row.state == "free") continue;
    ASSERT_EQ(row.state, "occupied");
    ASSERT_GT(row.sigma_m, 0);
    const runlog::PoseRow& pose = data.truth[std::size_t(row.frame)];
    const double bearing_rad = pose.heading_rad + row.beam_rad;
    const double off_m = arena.clearance_m(
        {pose.x_m + row.range_m * std::cos(bearing_rad), pose.y_m + row.range_m * std::sin(bearing_rad)});
    ++occupied;
    constexpr double kNear_m = 0.08;  // half a degree at 3 m, and what curtains and books stand out by
    there += std::abs(off_m) < kNear_m ? 1 : 0;
  }
  EXPECT_GE(occupied, kFrames * 200);
  EXPECT_GE(there, 0.85 * occupied) << "the others are beside the outlines of things";
}

TEST_F(ScanOfARun, PlacesFramesByTheFloorPlanWithoutLandmarks) {
  const fs::path run = copy();
  const std::string yaml = config::read_text(run / "run.yaml");
  const auto counts = scan(run, {.plan = true});
  ASSERT_TRUE(counts) << counts.error().message;
  EXPECT_EQ(counts->placed, kFrames);
  ASSERT_TRUE(counts->position_error_m && counts->heading_error_rad);
  EXPECT_LT(*counts->position_error_m, 0.02);
  EXPECT_LT(*counts->heading_error_rad, 0.3 * std::numbers::pi / 180);
  EXPECT_EQ(std::ranges::count(config::read_text(plan_file(run)), '\n'), 1 + kFrames);
  EXPECT_EQ(config::read_text(run / "run.yaml"), yaml);
}

// Catches a run that scans for its track and does not store what it saw, or stores other beams than `scan` finds.
TEST_F(ScanOfARun, ARunThatScansHasTheSameTable) {
  config::Robot robot = config::read_robot(fs::path(TWOCONE_SOURCE_DIR) / "robots/scout_sim.yaml");
  robot.estimator.plan = true;
  runs::RunOptions options;
  options.frames = kFrames;
  options.out = own_.path() / "scanned";
  options.renderer = sim_povray::RendererKind::kNative;
  const std::atomic<bool> never = false;
  const auto driven = runs::run(
      robot, config::read_map(robot.map), options, [](double) {}, never);
  ASSERT_TRUE(driven) << driven.error().message;
  for (const runlog::TrackRow& row : runlog::read_run(options.out).track) EXPECT_EQ(row.plan, "taken");
  const std::string stored = config::read_text(scan_file(options.out));
  ASSERT_TRUE(scan(options.out, {}));
  EXPECT_EQ(config::read_text(scan_file(options.out)), stored);
}

TEST_F(ScanOfARun, CloudsHoldThePointsThatTheirHeadersCount) {
  const fs::path run = copy();
  const auto counts = scan(run, {.every = 2, .clouds = true});
  ASSERT_TRUE(counts) << counts.error().message;
  EXPECT_EQ(counts->frames, 2);
  EXPECT_EQ(counts->clouds, 2);
  long points = 0;
  for (const char* const name : {"000000.ply", "000002.ply"}) {
    const std::string cloud = config::read_text(run / "clouds" / name);
    ASSERT_THAT(cloud, HasSubstr("comment twocone, metres, world frame, z up\n"));
    const std::size_t begin = cloud.find("end_header\n") + 11;
    const long count = std::stol(cloud.substr(cloud.find("element vertex ") + 15));
    EXPECT_EQ(cloud.size() - begin, std::size_t(count) * 16);
    points += count;
  }
  EXPECT_EQ(points, counts->points);
  EXPECT_GT(points, 20000);
  EXPECT_FALSE(fs::exists(run / "clouds.new"));
}

TEST_F(ScanOfARun, LeavesOutFramesWithoutImagesAndChangesNothingWithoutAny) {
  const fs::path run = copy();
  fs::remove(runlog::lower_image_file(run, 1));
  const auto counts = scan(run, {});
  ASSERT_TRUE(counts) << counts.error().message;
  EXPECT_EQ(counts->frames, kFrames - 1);
  EXPECT_EQ(counts->without_images, 1);
  const std::string before = config::read_text(scan_file(run));
  for (const int frame : {0, 2}) fs::remove(runlog::upper_image_file(run, std::uint64_t(frame)));
  const auto none = scan(run, {.clouds = true});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no frame has both its images"));
  EXPECT_EQ(config::read_text(scan_file(run)), before);
  EXPECT_FALSE(fs::exists(run / "clouds.new"));
}

TEST_F(ScanOfARun, StopsFromOutsideAndRefusesWhatItCannotDo) {
  const fs::path run = copy();
  const std::atomic<bool> stop = true;
  const auto stopped = scan(run, {.clouds = true, .stop = &stop});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_FALSE(fs::exists(scan_file(run)));
  EXPECT_FALSE(fs::exists(run / "clouds.new"));
  EXPECT_THROW((void)scan(run, {.every = 0}), std::invalid_argument);
  EXPECT_THROW((void)scan(own_.path(), {}), config::FileError);
}

}  // namespace
}  // namespace twocone::scan
