// SPDX-License-Identifier: Apache-2.0
#include "apps/telemetry/telemetry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/runlog/answer_rows.h"
#include "apps/runlog/storage/disk.h"
#include "tests/report/synthetic_run.h"

namespace twocone::telemetry {
namespace {

using Json = nlohmann::ordered_json;
using report::outline_run;
using report::ScratchFolder;
using report::synthetic_run;

constexpr int kFrames = 30;

/// Returns the keys of an object whose value is not a finite number, text, or a list or object of these.
std::vector<std::string> bad_values(const Json& json) {
  std::vector<std::string> bad;
  const Json flat = json.flatten();
  for (const auto& [key, value] : flat.items()) {
    const bool is_pixel_without_place = value.is_null() && key.find("/pixels_px/") != std::string::npos;
    if (value.is_null() && !is_pixel_without_place) bad.push_back(key);
  }
  return bad;
}

TEST(Telemetry, ALineHasTheRowsOfItsFrame) {
  const ScratchFolder folder;
  const runlog::RunData run = outline_run(synthetic_run(folder.path(), kFrames));
  const StoredRun stored(run);
  ASSERT_EQ(stored.size(), std::size_t(kFrames));
  for (std::size_t row = 0; row < stored.size(); ++row) {
    const Json line = stored.frame(row);
    EXPECT_EQ(line["type"], "frame");
    EXPECT_EQ(line["frame"], run.frames[row].frame);
    EXPECT_EQ(line["truth"]["x_m"], run.truth[row].x_m);
    EXPECT_EQ(line["odometry"]["heading_rad"], run.odometry[row].heading_rad);
    ASSERT_EQ(line["ranges"].size(), run.map.landmarks.size());
    for (std::size_t i = 0; i < run.map.landmarks.size(); ++i) {
      const runlog::RangeRow& range = run.ranges[row * run.map.landmarks.size() + i];
      const Json& in_line = line["ranges"][i];
      EXPECT_EQ(in_line["landmark"], range.landmark);
      EXPECT_EQ(in_line["verdict"], range.verdict);
      EXPECT_EQ(in_line.contains("range_m"), range.range_m.has_value());
      if (range.range_m) {
        EXPECT_EQ(in_line["range_m"], *range.range_m);
      }
      EXPECT_FALSE(in_line.contains("frame"));
    }
    for (const Json& sighting : line["sightings"]) EXPECT_TRUE(sighting.contains("column_px"));
    EXPECT_THAT(bad_values(line), testing::IsEmpty());
  }
  EXPECT_EQ(stored.frame(3)["fixes"][0]["outliers"][0], run.map.landmarks[2].name);
}

TEST(Telemetry, ALineHasTheScanOfItsFrame) {
  const ScratchFolder folder;
  const runlog::RunData run = synthetic_run(folder.path(), kFrames);
  const std::vector<vision::Beam> scan{
      {vision::BeamState::kOccupied, 1.23456, 0.0123, 0.4, 0}, {}, {vision::BeamState::kFree, 2.5, 0, 0, 0}};
  std::string table = runlog::TableReader<runlog::ScanRow>::header() + '\n';
  for (const runlog::ScanRow& row : runlog::to_rows(run.frames[1].frame, run.frames[1].t_s, scan)) {
    table += to_line(row) + '\n';
  }
  EXPECT_THAT(table, testing::HasSubstr(",-2.0944,occupied,1.2346,0.0123\n"));
  EXPECT_THAT(table, testing::HasSubstr(",0,unknown,,\n"));
  runlog::write_whole(run.folder / "scan.csv", table);
  const StoredRun stored(run);
  EXPECT_EQ(stored.frame(1)["scan"], Json({{"states", "ouf"}, {"ranges_m", {1.235, nullptr, 2.5}}}));
  EXPECT_FALSE(stored.frame(0).contains("scan"));
}

TEST(Telemetry, TheFirstLineDescribesRobotMapAndViews) {
  const ScratchFolder folder;
  const runlog::RunData run = synthetic_run(folder.path(), kFrames);
  const StoredRun stored(run);
  const Json line = stored.run();
  EXPECT_EQ(line["robot"]["name"], run.robot.name);
  EXPECT_EQ(line["map"]["landmarks"].size(), run.map.landmarks.size());
  EXPECT_EQ(line["map"]["landmarks"][0]["rgb"], Json({255, 0, 0}));
  EXPECT_EQ(line["map"]["obstacles"].size(), run.map.obstacles.size());
  EXPECT_TRUE(line["sensors"]["truth"]);
  EXPECT_FALSE(line["sensors"]["images"]) << "the folder has none";
  EXPECT_THAT(bad_values(line), testing::IsEmpty());
  // The panorama's middle column is straight ahead: the rim's pixel lies a rim radius from the tip.
  const Json& unroll = line["views"]["lower"]["unroll"];
  const auto bearings = unroll["bearings"].get<std::size_t>();
  ASSERT_EQ(unroll["pixels_px"].size(), bearings * unroll["radii"].get<std::size_t>());
  const Json& ahead = unroll["pixels_px"][bearings / 2];
  const vision::Rig rig = config::to_rig(run.robot);
  const auto& settings = rig.lower.settings();
  const Eigen::Vector2d expected = settings.centre_px + rig.lower.offset_px(0, settings.rim_radius_px);
  EXPECT_NEAR(ahead[0].get<double>(), expected.x(), 0.006);
  EXPECT_NEAR(ahead[1].get<double>(), expected.y(), 0.006);
}

TEST(Telemetry, WhatARunLacksIsLeftOut) {
  const ScratchFolder folder;
  runlog::RunData run = synthetic_run(folder.path(), kFrames);
  report::remove_truth(run);
  run.odometry.clear();
  run.info.behaviour = runlog::kImported;
  const StoredRun stored(run);
  const Json first = stored.run();
  EXPECT_FALSE(first["sensors"]["truth"]);
  EXPECT_FALSE(first["sensors"]["odometry"]);
  const Json line = stored.frame(0);
  for (const char* key : {"truth", "odometry", "drive", "track", "timing"}) EXPECT_FALSE(line.contains(key)) << key;
}

// Against the near point of vision, which is computed in another way.
TEST(Telemetry, TheOutlinesMiddleIsTheNearPointOfTheTop) {
  config::Robot robot = testing_support::with_images(testing_support::lab_robot(), 640, 480, 225);
  robot.rig.lower.tilt_rad = {0.011, -0.007};
  robot.rig.lower.axis_offset_m = {0.004, -0.003};
  const vision::MirrorView view = config::to_rig(robot).lower;
  constexpr double kRadius_m = 0.083, kTop_m = 0.87;
  for (const double bearing_rad : {-2.7, -0.4, 0.9, 3.1}) {
    const Eigen::Vector2d p_BL_m = 2.3 * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
    const auto outline = outline_px(view, p_BL_m, kRadius_m, kTop_m);
    const auto near_m = vision::near_top_point(view, p_BL_m, kRadius_m, kTop_m);
    ASSERT_TRUE(near_m);
    const auto near_px = view.project(*near_m);
    ASSERT_TRUE(near_px);
    double nearest_px = 1e9;
    for (const Eigen::Vector2d& px : outline) nearest_px = std::min(nearest_px, (px - *near_px).norm());
    EXPECT_LT(nearest_px, 1e-6) << bearing_rad;
  }
  EXPECT_TRUE(outline_px(view, {0.05, 0}, kRadius_m, kTop_m).empty()) << "the landmark encloses the view's axis";
}

TEST(Telemetry, APageEmbedsSmallImagesAndEachNthFrame) {
  const ScratchFolder folder;
  const int frames = int(kMostFrames) + 50;
  const runlog::RunData run = synthetic_run(folder.path(), frames, 4);
  const Json page = embedded(StoredRun(run));
  EXPECT_EQ(page["every"], 2);
  ASSERT_EQ(page["frames"].size(), std::size_t(frames) / 2);
  EXPECT_EQ(page["frames"][1]["frame"], 2);
  EXPECT_EQ(page["images"].size(), std::size_t(frames) / 4) << "every fourth frame has images";
  EXPECT_THAT(page["images"]["4"]["upper"].get<std::string>(), testing::StartsWith("data:image/jpeg;base64,/9j/"));
}

}  // namespace
}  // namespace twocone::telemetry
