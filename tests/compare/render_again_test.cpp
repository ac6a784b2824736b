// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/tables/tables.h"
#include "tests/compare/synthetic_run.h"
#include "vision/calibration.h"

namespace twocone::compare {
namespace {

using testing_support::TemporaryFolder;

constexpr int kRunFrames = 5;

class RenderingAgain : public testing::Test {
 protected:
  void SetUp() override {
    if (!vision::can_calibrate()) GTEST_SKIP() << "needs Ceres, which this build does not have";
    for (const char* const name : {"lab.pov", "lab.map.yaml"}) {
      std::filesystem::copy_file(std::filesystem::path(TWOCONE_SOURCE_DIR) / "scenes" / name, folder_.path() / name);
    }
    settings_.real = make_run(folder_, "real", {.driver = "memory", .frames = kRunFrames});
    settings_.simulated = folder_.path() / "simulated";
    settings_.fit_frames = kRunFrames;
  }

  /// Returns the time at which each image was written.
  [[nodiscard]] std::vector<std::filesystem::file_time_type> times() const {
    std::vector<std::filesystem::file_time_type> times;
    for (std::uint64_t frame = 0; frame < kRunFrames; ++frame) {
      times.push_back(std::filesystem::last_write_time(runlog::lower_image_file(settings_.simulated, frame)));
      times.push_back(std::filesystem::last_write_time(runlog::upper_image_file(settings_.simulated, frame)));
    }
    return times;
  }

  TemporaryFolder folder_;
  Settings settings_;
  std::filesystem::path scene_ = folder_.path() / "lab.map.yaml";
};

TEST_F(RenderingAgain, ShowsTheSceneFromWhereTheRobotWas) {
  const Status rendered = render_again(settings_, scene_);
  ASSERT_TRUE(rendered) << rendered.error().message;
  const auto truth = runlog::read_poses(settings_.real / "truth.tum");
  const auto places = runlog::read_poses(settings_.simulated / "truth.tum");
  ASSERT_EQ(places.size(), truth.size());
  constexpr double kFix_m = 0.01;  // of images of 320 pixels
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(places[i].x_m, truth[i].x_m, kFix_m);
    EXPECT_NEAR(places[i].y_m, truth[i].y_m, kFix_m);
  }
  // The fixes of method outline from the new images are the poses at which these were rendered.
  const auto fixes = runlog::read_table<runlog::FixRow>(settings_.simulated / "fixes.csv");
  ASSERT_EQ(fixes.size(), places.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    ASSERT_TRUE(fixes[i].x_m) << "frame " << i;
    EXPECT_LT(std::hypot(*fixes[i].x_m - places[i].x_m, *fixes[i].y_m - places[i].y_m), kFix_m) << "frame " << i;
  }
}

TEST_F(RenderingAgain, ContinuesButNotWithAnotherScene) {
  ASSERT_TRUE(render_again(settings_, scene_));
  const auto first = times();
  std::filesystem::remove(runlog::upper_image_file(settings_.simulated, kRunFrames - 1));
  ASSERT_TRUE(render_again(settings_, scene_));
  const auto continued = times();
  EXPECT_TRUE(std::equal(first.begin(), first.end() - 2, continued.begin()))
      << "existing images are not rendered again";
  EXPECT_GT(continued.back(), first.back());

  std::ofstream(folder_.path() / "lab.pov", std::ios::app) << "// a lamp was moved\n";
  ASSERT_TRUE(render_again(settings_, scene_));
  const auto again = times();
  for (std::size_t i = 0; i < again.size(); ++i) EXPECT_GT(again[i], continued[i]) << "image " << i;
}

TEST_F(RenderingAgain, RejectsAMapWithoutAScene) {
  std::string map = folder_.read("lab.map.yaml");
  for (const char* const key : {"\nscene:", "\nmoving:", "\neffects:"}) {
    if (const auto at = map.find(key); at != std::string::npos) map.insert(at + 1, "# ");
  }
  scene_ = folder_.write("room.map.yaml", map);
  EXPECT_THROW((void)render_again(settings_, scene_), config::FileError);
}

}  // namespace
}  // namespace twocone::compare
