// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/render_again.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "apps/files/file_error.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/tables.h"
#include "tests/compare/synthetic_run.h"
#include "vision/calibration.h"

namespace twocone::compare {
namespace {

using testing_support::TemporaryFolder;

constexpr int kFrames = 5;

class RenderingAgain : public testing::Test {
 protected:
  void SetUp() override {
    if (!vision::can_calibrate()) GTEST_SKIP() << "needs Ceres, which this build has not";
    for (const char* const name : {"lab.pov", "lab.map.yaml"}) {
      std::filesystem::copy_file(std::filesystem::path(TWOCONE_SOURCE_DIR) / "scenes" / name, folder_.path() / name);
    }
    settings_.real = make_run(folder_, "real", {.driver = "memory", .frames = kFrames});
    settings_.scene = folder_.path() / "lab.map.yaml";
    settings_.to = folder_.path() / "simulated";
    settings_.fit_frames = kFrames;
  }

  /// When each picture was made.
  [[nodiscard]] std::vector<std::filesystem::file_time_type> times() const {
    std::vector<std::filesystem::file_time_type> times;
    for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
      times.push_back(std::filesystem::last_write_time(runs::lower_picture(settings_.to, frame)));
      times.push_back(std::filesystem::last_write_time(runs::upper_picture(settings_.to, frame)));
    }
    return times;
  }

  TemporaryFolder folder_;
  RenderAgain settings_;
};

TEST_F(RenderingAgain, ShowsTheSceneFromWhereTheRobotWas) {
  const Status rendered = render_again(settings_);
  ASSERT_TRUE(rendered) << rendered.error().message;
  const auto truth = runs::read_poses(settings_.real / "truth.tum");
  const auto places = runs::read_poses(settings_.to / "truth.tum");
  ASSERT_EQ(places.size(), truth.size());
  constexpr double kFix_m = 0.01;  // of pictures of 320 pixels
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(places[i].x_m, truth[i].x_m, kFix_m);
    EXPECT_NEAR(places[i].y_m, truth[i].y_m, kFix_m);
  }
  // What method full makes of the new pictures is where they were rendered from.
  const auto fixes = runs::read_fixes(settings_.to / "fixes.csv");
  ASSERT_EQ(fixes.size(), places.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    ASSERT_TRUE(fixes[i].x_m) << "frame " << i;
    EXPECT_LT(std::hypot(*fixes[i].x_m - places[i].x_m, *fixes[i].y_m - places[i].y_m), kFix_m) << "frame " << i;
  }
}

TEST_F(RenderingAgain, GoesOnButNotWithAnotherScene) {
  ASSERT_TRUE(render_again(settings_));
  const auto first = times();
  std::filesystem::remove(runs::upper_picture(settings_.to, kFrames - 1));
  ASSERT_TRUE(render_again(settings_));
  const auto gone_on = times();
  EXPECT_TRUE(std::equal(first.begin(), first.end() - 2, gone_on.begin())) << "what was there is not rendered again";
  EXPECT_GT(gone_on.back(), first.back());

  std::ofstream(folder_.path() / "lab.pov", std::ios::app) << "// a lamp was moved\n";
  ASSERT_TRUE(render_again(settings_));
  const auto anew = times();
  for (std::size_t i = 0; i < anew.size(); ++i) EXPECT_GT(anew[i], gone_on[i]) << "picture " << i;
}

TEST_F(RenderingAgain, RefusesAMapWithoutAScene) {
  std::string map = folder_.read("lab.map.yaml");
  for (const char* const key : {"\nscene:", "\nmoving:", "\neffects:"}) {
    if (const auto at = map.find(key); at != std::string::npos) map.insert(at + 1, "# ");
  }
  settings_.scene = folder_.write("room.map.yaml", map);
  EXPECT_THROW((void)render_again(settings_), files::FileError);
}

}  // namespace
}  // namespace twocone::compare
