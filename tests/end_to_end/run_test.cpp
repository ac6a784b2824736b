// SPDX-License-Identifier: Apache-2.0
// Whole runs in the simulated lab: what a run promises about repetition, and about belief and truth.
#include "apps/runs/run.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "apps/files/to_layers.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/summary.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

constexpr int kFramesInTests = 14;
const std::string kSmall = TWOCONE_SOURCE_DIR "/tests/end_to_end/data/small.yaml";

/// ./evidence.sh sets these to the whole: 450 frames of robots/lab_sim.yaml.
int frame_count() {
  const char* wanted = std::getenv("TWOCONE_FRAMES");
  return wanted ? std::atoi(wanted) : kFramesInTests;
}
std::string robot_file() {
  const char* wanted = std::getenv("TWOCONE_ROBOT");
  return wanted ? wanted : kSmall;
}

class RunInTheLab : public testing::Test {
 protected:
  Result<RunInfo> go(const std::string& robot_file, const std::string& out, int frames,
                     const std::string& behaviour = "wander") {
    const files::Robot robot = files::read_robot(robot_file);
    const files::Map map = files::read_map(robot.map);
    RunOptions options;
    options.frames = frames;
    options.behaviour = behaviour;
    options.seed = 7;
    options.out = folder_ / out;
    return run(
        robot, map, options, [](double) {}, stop_);
  }

  static std::string bytes(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    EXPECT_TRUE(in) << file;
    return {std::istreambuf_iterator<char>(in), {}};
  }

  const testing_support::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
  std::atomic<bool> stop_{false};
};

TEST_F(RunInTheLab, TheSameSeedGivesTheSameBytesAndPixels) {
  const int frames = frame_count();
  for (const char* out : {"first", "second"}) {
    const auto info = go(robot_file(), out, frames);
    ASSERT_TRUE(info) << info.error().message;
  }
  for (const char* table :
       {"ranges.csv", "fixes.csv", "estimate.tum", "track.csv", "odometry.tum", "truth.tum", "drive.csv"}) {
    EXPECT_EQ(bytes(folder_ / "first" / table), bytes(folder_ / "second" / table)) << table;
  }
  for (int frame = 0; frame < frames; ++frame) {
    for (const auto& picture : {lower_picture, upper_picture}) {
      const auto first = read_picture(picture(folder_ / "first", std::uint64_t(frame)));
      const auto second = read_picture(picture(folder_ / "second", std::uint64_t(frame)));
      ASSERT_TRUE(first && second) << "frame " << frame;
      ASSERT_EQ(*first, *second) << "frame " << frame;
    }
  }
}

TEST_F(RunInTheLab, LocaliseGivesTheSameAnswersAgain) {
  const auto info = go(kSmall, "run", kFramesInTests);
  ASSERT_TRUE(info) << info.error().message;
  const std::filesystem::path run = folder_ / "run";
  const std::string ranges = bytes(run / "ranges.csv");
  const std::string fixes = bytes(run / "fixes.csv");
  const std::string estimate = bytes(run / "estimate.tum");
  const std::string baseline = bytes(run / "methods" / "paper" / "fixes.csv");
  ASSERT_NE(baseline, fixes) << "two methods of one answer: nothing would be shown below";

  const auto paper = localise(run, Method::kPaper, [](double) {});
  ASSERT_TRUE(paper) << paper.error().message;
  EXPECT_EQ(bytes(run / "fixes.csv"), baseline);

  const auto again = localise(run, kDefaultMethod, [](double) {});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(bytes(run / "ranges.csv"), ranges);
  EXPECT_EQ(bytes(run / "fixes.csv"), fixes);
  EXPECT_EQ(bytes(run / "estimate.tum"), estimate);
  EXPECT_EQ(bytes(run / "methods" / "full" / "fixes.csv"), fixes);
}

// What the robot believes of its mirrors must not reach the simulator.
TEST_F(RunInTheLab, NoValueOfTheRigChangesAPixel) {
  std::vector<std::vector<Image>> pictures;
  for (const char* name : {"small.yaml", "other_rig.yaml"}) {
    const files::Robot file = files::read_robot(std::string(TWOCONE_SOURCE_DIR "/tests/end_to_end/data/") + name);
    const auto settings = files::to_robot_settings(file, files::read_map(file.map), 7);
    auto robot = drivers::open_robot(settings);
    ASSERT_TRUE(robot) << robot.error().message;
    ASSERT_TRUE(robot->start(settings.lower.settings, settings.upper.settings));
    auto& seen = pictures.emplace_back();
    for (int i = 0; i < 4; ++i) {
      const auto frame = robot->next_frame(std::chrono::seconds(30));
      ASSERT_TRUE(frame) << frame.error().message;
      ASSERT_TRUE(robot->drive().set_speeds({3.1, 5.3}));
      for (const Frame& view : {frame->lower, frame->upper}) {
        const auto image = view.image(std::chrono::seconds(60));
        ASSERT_TRUE(image) << image.error().message;
        seen.push_back(**image);
      }
    }
  }
  EXPECT_EQ(pictures[0], pictures[1]);
  EXPECT_NE(pictures[0][0], pictures[0][6]) << "the robot did not move: nothing was shown";
}

// Catches a run that asks for the time of POV-Ray while it still has its processes, and so is told of none.
TEST_F(RunInTheLab, TellsWhatRenderingTook) {
  const auto info = go(kSmall, "run", 6, "still");
  ASSERT_TRUE(info) << info.error().message;
  // Twelve pictures of 160 x 120 pixels; on any machine their pixels take more than a hundredth of a second each.
  EXPECT_GT(info->render_cpu_s, 0.12);
}

TEST_F(RunInTheLab, ARigThatIsOffIsWarnedOf) {
  const auto info = go(TWOCONE_SOURCE_DIR "/tests/end_to_end/data/rim_off.yaml", "run", 1, "still");
  ASSERT_TRUE(info) << info.error().message;
  ASSERT_EQ(info->events.size(), 1U) << "only the lower rim is off: " << info->events.back();
  EXPECT_NE(info->events[0].find("the lower mirror's rim is seen"), std::string::npos) << info->events[0];
  EXPECT_NE(info->events[0].find("radius 59."), std::string::npos) << info->events[0];
}

TEST_F(RunInTheLab, StopsWhenAskedAndKeepsWhatIsThere) {
  stop_ = true;
  const auto info = go(kSmall, "run", 5);
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().message, "stopped from outside after 0 frames");
  const RunData data = read_run(folder_ / "run");
  EXPECT_FALSE(data.info.finished);
  EXPECT_TRUE(data.frames.empty());
}

TEST_F(RunInTheLab, ARunIsNotLostToAnother) {
  ASSERT_TRUE(go(kSmall, "run", 1, "still"));
  EXPECT_THROW((void)go(kSmall, "run", 1, "still"), DiskError);
}

TEST_F(RunInTheLab, WaypointsAreReachedByFixesNotByTruth) {
  // Four seconds at 0.35 m/s towards (1, 0).
  const auto info = go(kSmall, "run", 60, "waypoints");
  ASSERT_TRUE(info) << info.error().message;
  const RunData data = read_run(folder_ / "run");
  double nearest_m = 9;
  for (const PoseRow& pose : data.truth) nearest_m = std::min(nearest_m, std::hypot(pose.x_m - 1, pose.y_m));
  // Reached by belief within 0.1 m; the belief is off by the smoothed error of fixes with pixels four times as coarse.
  EXPECT_LT(nearest_m, 0.3);
  EXPECT_GT(data.truth.back().y_m, -1.0);
}

}  // namespace
}  // namespace twocone::runs
