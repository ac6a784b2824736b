// SPDX-License-Identifier: Apache-2.0
// Whole runs in the simulated lab: repeatability, and the separation of estimate and truth.
#include "apps/runs/run.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/tables/tables.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

constexpr int kFramesInTests = 14;
const std::string kSmall = TWOCONE_SOURCE_DIR "/tests/end_to_end/data/small.yaml";

/// ./evidence.sh sets these variables for the full test: 450 frames of robots/lab_sim.yaml.
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
  Result<runlog::RunInfo> go(const std::string& robot_file, const std::string& out, int frames,
                             const std::string& behaviour = "wander") {
    const config::Robot robot = config::read_robot(robot_file);
    const config::Map map = config::read_map(robot.map);
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
    for (const auto& image : {runlog::lower_image_file, runlog::upper_image_file}) {
      const auto first = runlog::read_image(image(folder_ / "first", std::uint64_t(frame)));
      const auto second = runlog::read_image(image(folder_ / "second", std::uint64_t(frame)));
      ASSERT_TRUE(first && second) << "frame " << frame;
      ASSERT_EQ(*first, *second) << "frame " << frame;
    }
  }
}

// Catches answers that wait until a paced run steers by them, so that watchers see each frame late, and a pace that
// changes the answers or the decisions.
TEST_F(RunInTheLab, InRealTimeAnswersComeEarlyAndStayTheSame) {
  const config::Robot robot = config::read_robot(kSmall);
  ASSERT_GT(robot.latency_frames, 0);
  RunOptions options;
  options.frames = kFramesInTests;
  options.seed = 7;
  options.out = folder_ / "paced";
  options.real_time = true;
  double least_age_s = 1e9;
  options.finished = [&](const FinishedFrame&, const LiveFigures& figures) {
    least_age_s = std::min(least_age_s, figures.age_s);
  };
  ASSERT_TRUE(run(
      robot, config::read_map(robot.map), options, [](double) {}, stop_));
  EXPECT_LT(least_age_s, robot.latency_frames / robot.lower.settings.rate_hz);
  ASSERT_TRUE(go(kSmall, "free", kFramesInTests));
  for (const char* table : {"ranges.csv", "fixes.csv", "track.csv", "truth.tum", "drive.csv"}) {
    EXPECT_EQ(bytes(folder_ / "paced" / table), bytes(folder_ / "free" / table)) << table;
  }
}

// Catches a run that uses the map's landmarks although it should not, or that does not store those that it finds. A
// run that is cut off and resumed finds the same.
TEST_F(RunInTheLab, FindsTheLandmarksOnTheWay) {
  const config::Robot robot = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  RunOptions options;
  options.frames = 20;
  options.seed = 7;
  options.maps = true;
  options.out = folder_ / "run";
  std::atomic<bool> stop{false};
  const auto cut = run(
      robot, config::read_map(robot.map), options, [&](double done) { stop = stop || done * options.frames > 12; },
      stop);
  ASSERT_FALSE(cut);
  ASSERT_TRUE(resume(
      folder_ / "run", {}, [](double) {}, stop_));
  const runlog::RunData data = runlog::read_run(folder_ / "run");
  EXPECT_TRUE(data.info.maps);
  EXPECT_TRUE(data.ranges.empty());
  ASSERT_EQ(data.track.size(), 20U);
  EXPECT_EQ(data.track.back().state, "tracking");
  EXPECT_NEAR(*data.track.back().x_m, data.truth.back().x_m, 0.02);
  const auto rows = runlog::read_table<runlog::LandmarkRow>(folder_ / "run" / "landmarks.csv");
  ASSERT_FALSE(rows.empty());
  for (const runlog::LandmarkRow& row : rows) {
    EXPECT_EQ(row.frame, 15U);
    const auto is = std::ranges::min_element(
        data.map.landmarks, {}, [&](const Landmark& l) { return std::hypot(l.x_m - row.x_m, l.y_m - row.y_m); });
    EXPECT_LT(std::hypot(is->x_m - row.x_m, is->y_m - row.y_m), 0.2) << row.landmark;
    EXPECT_GE(row.sightings, 6U);
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "run" / "methods" / "outline" / "landmarks.csv"));
}

// Catches a floor plan that is silently left out.
TEST_F(RunInTheLab, LandmarksFromTheWayAndAFloorPlanAreNotUsedTogether) {
  config::Robot robot = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  robot.estimator.plan = true;
  RunOptions options;
  options.maps = true;
  options.out = folder_ / "run";
  EXPECT_THROW(static_cast<void>(run(
                   robot, config::read_map(robot.map), options, [](double) {}, stop_)),
               config::FileError);
}

TEST_F(RunInTheLab, LocaliseGivesTheSameAnswersAgain) {
  const auto info = go(kSmall, "run", kFramesInTests);
  ASSERT_TRUE(info) << info.error().message;
  const std::filesystem::path run = folder_ / "run";
  const std::string ranges = bytes(run / "ranges.csv");
  const std::string fixes = bytes(run / "fixes.csv");
  const std::string estimate = bytes(run / "estimate.tum");
  const std::string baseline = bytes(run / "methods" / "paper" / "fixes.csv");
  ASSERT_NE(baseline, fixes) << "both methods give one answer, so that the checks below show nothing";

  const auto paper = localise(run, estimation::Method::kPaper, [](double) {});
  ASSERT_TRUE(paper) << paper.error().message;
  EXPECT_EQ(bytes(run / "fixes.csv"), baseline);

  const auto again = localise(run, estimation::kDefaultMethod, [](double) {});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(bytes(run / "ranges.csv"), ranges);
  EXPECT_EQ(bytes(run / "fixes.csv"), fixes);
  EXPECT_EQ(bytes(run / "estimate.tum"), estimate);
  EXPECT_EQ(bytes(run / "methods" / "outline" / "fixes.csv"), fixes);
}

// Catches a former fault: an image in the middle was missing, and localise wrote tables of the frames before it.
TEST_F(RunInTheLab, LocaliseNamesAMissingImageAndChangesNothing) {
  ASSERT_TRUE(go(kSmall, "run", 6, "still"));
  const std::filesystem::path run = folder_ / "run";
  const std::string state = runlog::results_state(run), ranges = bytes(run / "ranges.csv");
  const auto refused = [&] {
    const auto again = localise(run, estimation::kDefaultMethod, [](double) {});
    EXPECT_EQ(runlog::results_state(run), state);
    return again ? std::string("none") : again.error().message;
  };
  const std::string upper = bytes(runlog::upper_image_file(run, 2));
  std::filesystem::remove(runlog::upper_image_file(run, 2));
  EXPECT_THAT(refused(), testing::AllOf(testing::HasSubstr("upper/000002.png"), testing::HasSubstr("--allow-missing")));
  std::ofstream(runlog::upper_image_file(run, 2)) << upper.substr(0, 20);  // damaged
  EXPECT_THAT(refused(), testing::HasSubstr("upper/000002.png is not an image"));

  const auto allowed = localise(run, estimation::kDefaultMethod, [](double) {}, {.allow_missing = true});
  ASSERT_TRUE(allowed) << allowed.error().message;
  EXPECT_EQ(allowed->frames.size(), 6U);
  ASSERT_EQ(allowed->fixes.size(), 6U);
  for (const runlog::FixRow& row : allowed->fixes) EXPECT_EQ(row.verdict == "no_image", row.frame == 2) << row.frame;
  for (const runlog::RangeRow& row : allowed->ranges) {
    EXPECT_EQ(row.verdict == "no_image", row.frame == 2) << row.frame;
    EXPECT_FALSE(row.frame == 2 && row.range_m);
  }
  EXPECT_NE(bytes(run / "ranges.csv"), ranges);

  std::filesystem::remove_all(run / "upper");
  const std::string before = runlog::results_state(run);
  EXPECT_FALSE(localise(run, estimation::kDefaultMethod, [](double) {}, {.allow_missing = true}))
      << "no frame can be used";
  std::filesystem::rename(run / "frames.csv", run / "frames");
  EXPECT_THROW((void)localise(run, estimation::kDefaultMethod, [](double) {}), config::FileError);
  EXPECT_EQ(runlog::results_state(run), before);
}

TEST_F(RunInTheLab, AStoppedLocaliseChangesNothing) {
  ASSERT_TRUE(go(kSmall, "run", 3, "still"));
  const std::string state = runlog::results_state(folder_ / "run");
  std::atomic<bool> stop{false};
  const auto again = localise(folder_ / "run", estimation::Method::kPaper, [&stop](double done) { stop = done > 0.5; },
                              {.stop = &stop});
  ASSERT_FALSE(again);
  EXPECT_EQ(runlog::results_state(folder_ / "run"), state);
}

// The robot's parameters of its mirrors must not influence the simulator.
TEST_F(RunInTheLab, NoValueOfTheRigChangesAPixel) {
  std::vector<std::vector<Image>> images;
  for (const char* name : {"small.yaml", "other_rig.yaml"}) {
    const config::Robot file = config::read_robot(std::string(TWOCONE_SOURCE_DIR "/tests/end_to_end/data/") + name);
    const auto settings = config::to_robot_settings(file, config::read_map(file.map), 7);
    auto robot = drivers::open_robot(settings);
    ASSERT_TRUE(robot) << robot.error().message;
    ASSERT_TRUE(robot->start(settings.lower.settings, settings.upper.settings));
    auto& seen = images.emplace_back();
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
  EXPECT_EQ(images[0], images[1]);
  EXPECT_NE(images[0][0], images[0][6]) << "the robot did not move, so that this test shows nothing";
}

// Catches a run that reads the processor time of POV-Ray while its processes still run, and so reports none.
TEST_F(RunInTheLab, ReportsTheTimeOfRendering) {
  const auto info = go(kSmall, "run", 6, "still");
  ASSERT_TRUE(info) << info.error().message;
  // Twelve images of 160 x 120 pixels take more than a hundredth of a second each on any machine.
  EXPECT_GT(info->render_cpu_s, 0.12);
}

TEST_F(RunInTheLab, AWrongRigGivesAWarning) {
  const auto info = go(TWOCONE_SOURCE_DIR "/tests/end_to_end/data/rim_off.yaml", "run", 1, "still");
  ASSERT_TRUE(info) << info.error().message;
  ASSERT_EQ(info->events.size(), 1U) << "only the lower rim is wrong: " << info->events.back();
  EXPECT_NE(info->events[0].find("rig.lower.rim_radius_px 59."), std::string::npos) << info->events[0];
  EXPECT_NE(info->events[0].find("run --self-rig"), std::string::npos) << info->events[0];
}

// Catches an empty folder after a failed start, which prevents the next start.
TEST_F(RunInTheLab, ARunThatEndsBeforeItsFirstFrameLeavesNoFolder) {
  stop_ = true;
  const auto info = go(kSmall, "run", 5);
  ASSERT_FALSE(info);
  EXPECT_EQ(info.error().message, "stopped from outside after 0 frames");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
}

/// Returns the file of a robot whose cameras draw random numbers and lose frames.
std::string noisy_robot(const testing_support::TemporaryFolder& folder) {
  std::string text = config::read_text(kSmall);
  const auto put = [&text](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  put("../../../scenes", TWOCONE_SOURCE_DIR "/scenes");
  put("encoder_counts_per_turn: 1024",
      "encoder_counts_per_turn: 1024, camera: {full_well_electrons: 8000, read_noise_electrons: 4, "
      "drop_probability: 0.15, late_probability: 0.15}");
  return folder.write("noisy.yaml", text).string();
}

class Resumed : public RunInTheLab {
 protected:
  static constexpr int kFrames = 12, kCutAfter = 4;

  void SetUp() override {
    robot_ = noisy_robot(temporary_);
    ASSERT_TRUE(go(robot_, "whole", kFrames));
    cut("cut");
  }

  /// Makes a run that is stopped from outside.
  void cut(const std::string& out) {
    const auto info = run_until(out, kCutAfter);
    ASSERT_FALSE(info);
    ASSERT_GE(runlog::read_run(folder_ / out).frames.size(), std::size_t(kCutAfter));
    ASSERT_LT(runlog::read_run(folder_ / out).frames.size(), std::size_t(kFrames));
  }

  Result<runlog::RunInfo> run_until(const std::string& out, int frame) {
    const config::Robot robot = config::read_robot(robot_);
    RunOptions options;
    options.frames = kFrames;
    options.seed = 7;
    options.out = folder_ / out;
    std::atomic<bool> stop{false};
    const auto stop_there = [&](double done) { stop = stop || done * kFrames >= frame - 0.5; };
    return run(robot, config::read_map(robot.map), options, stop_there, stop);
  }

  Result<runlog::RunInfo> resume_run(const std::string& out, int until = kFrames + 1) {
    std::atomic<bool> stop{false};
    const auto stop_there = [&](double done) { stop = stop || done * kFrames >= until - 0.5; };
    return resume(folder_ / out, {}, stop_there, stop);
  }

  void expect_like_whole(const std::string& out) const {
    for (const char* table :
         {"ranges.csv", "fixes.csv", "sightings.csv", "estimate.tum", "odometry.tum", "truth.tum", "drive.csv",
          "track.csv", "methods/outline/fixes.csv", "methods/paper/fixes.csv", "methods/paper/ranges.csv"}) {
      EXPECT_EQ(bytes(folder_ / out / table), bytes(folder_ / "whole" / table)) << table;
    }
    const auto whole = runlog::read_table<runlog::FrameRow>(folder_ / "whole" / "frames.csv"),
               again = runlog::read_table<runlog::FrameRow>(folder_ / out / "frames.csv");
    ASSERT_EQ(again.size(), whole.size());
    std::uint64_t lost = 0;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      runlog::FrameRow row = again[i];
      row.host_t_s = whole[i].host_t_s;
      EXPECT_EQ(runlog::to_line(row), runlog::to_line(whole[i]));
      lost += whole[i].lower_lost;
      for (const auto& image : {runlog::lower_image_file, runlog::upper_image_file}) {
        const auto one = runlog::read_image(image(folder_ / "whole", i)),
                   other = runlog::read_image(image(folder_ / out, i));
        ASSERT_TRUE(one && other) << i;
        EXPECT_EQ(*one, *other) << i;
      }
    }
    EXPECT_GT(lost, 0U) << "no frame was lost, so that frame and sequence number are equal and this test shows less";
    EXPECT_TRUE(runlog::read_run(folder_ / out).info.finished);
  }

  std::string refusal(const std::string& out) {
    try {
      (void)resume_run(out);
    } catch (const config::FileError& error) {
      return error.what();
    }
    return "none";
  }

  std::string robot_;
};

TEST_F(Resumed, EqualsAnUninterruptedRun) {
  const auto info = resume_run("cut");
  ASSERT_TRUE(info) << info.error().message;
  expect_like_whole("cut");
  EXPECT_THAT(refusal("cut"), testing::HasSubstr("it is finished, with all its 12 frames"));
}

// run.yaml alone says that the run is paced.
TEST_F(Resumed, IsPacedAsBefore) {
  const std::filesystem::path yaml = folder_ / "cut" / "run.yaml";
  std::string text = bytes(yaml);
  text.replace(text.find("finished: "), 0, "real_time: true\n");
  std::ofstream(yaml, std::ios::trunc) << text;
  const auto info = resume_run("cut");
  ASSERT_TRUE(info) << info.error().message;
  EXPECT_TRUE(info->real_time);
  EXPECT_THAT(info->events, testing::Contains(testing::HasSubstr("real time, a frame each ")));
  EXPECT_TRUE(runlog::read_run(folder_ / "cut").info.real_time);
  expect_like_whole("cut");
}

// The state after kill -9: rows of a frame that is not in frames.csv, half a line, no recorded end. Then the run is
// stopped a second time.
TEST_F(Resumed, AHalfWrittenLineALostImageAndASecondStopChangeNothing) {
  const std::filesystem::path run = folder_ / "cut";
  const std::string drive = bytes(folder_ / "whole" / "drive.csv"), frames = bytes(run / "frames.csv");
  std::ofstream(run / "drive.csv", std::ios::trunc) << drive.substr(0, drive.size() / 2);
  std::ofstream(run / "frames.csv", std::ios::app) << "5,0.3";
  std::filesystem::remove(runlog::lower_image_file(run, 1));
  std::ofstream(runlog::upper_image_file(run, 2), std::ios::trunc) << "no image";
  ASSERT_FALSE(resume_run("cut", 2)) << "it was stopped while it replayed";
  EXPECT_EQ(bytes(run / "frames.csv").substr(0, frames.size()), frames) << "a table became shorter";
  const auto info = resume_run("cut");
  ASSERT_TRUE(info) << info.error().message;
  expect_like_whole("cut");
}

TEST_F(Resumed, IsRefusedWhereTheResultCouldDiffer) {
  const auto change = [](const std::filesystem::path& file, const std::string& from, const std::string& to) {
    std::string text = bytes(file);
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(file, std::ios::trunc) << text;
  };
  const std::filesystem::path yaml = folder_ / "cut" / "run.yaml";
  const std::string kept = bytes(yaml), robot = bytes(robot_);
  const auto put_back = [&] {
    std::ofstream(yaml, std::ios::trunc) << kept;
    std::ofstream(robot_, std::ios::trunc) << robot;
  };
  change(robot_, "wheel_radius_m: 0.05", "wheel_radius_m: 0.06");
  EXPECT_THAT(refusal("cut"), testing::EndsWith("noisy.yaml: drive.wheel_radius_m was 0.05, and is 0.06"));
  put_back();
  change(yaml, "commit: ", "commit: 123");
  EXPECT_THAT(refusal("cut"), testing::HasSubstr("made it, and this is"));
  put_back();
  const std::string scene = TWOCONE_SOURCE_DIR "/scenes/lab.pov";
  change(yaml, scene + ": \"", scene + ": \"0");
  EXPECT_THAT(refusal("cut"), testing::EndsWith("lab.pov has changed"));
  put_back();
  change(yaml, "name: red", "name: rot");
  EXPECT_THAT(refusal("cut"), testing::HasSubstr("lab.map.yaml: landmarks[0].name was rot, and is red"));
  put_back();
  change(yaml, "driver: sim_povray", "driver: memory");
  change(yaml, "driver: sim_povray", "driver: memory");
  change(yaml, "driver: sim_povray", "driver: memory");
  EXPECT_THAT(refusal("cut"), testing::HasSubstr("its robot is real"));
  put_back();
  // The stored rows and the recomputed rows must be equal, whatever the reason of a difference.
  change(folder_ / "cut" / "truth.tum", "0.0", "0.1");
  EXPECT_THROW((void)resume_run("cut"), runlog::DiskError);
}

TEST_F(RunInTheLab, ARunDoesNotReplaceAnother) {
  ASSERT_TRUE(go(kSmall, "run", 1, "still"));
  EXPECT_THROW((void)go(kSmall, "run", 1, "still"), runlog::DiskError);
}

TEST_F(RunInTheLab, WaypointsAreReachedByFixesNotByTruth) {
  // The robot drives four seconds at 0.35 m/s towards (1, 0).
  const auto info = go(kSmall, "run", 60, "waypoints");
  ASSERT_TRUE(info) << info.error().message;
  const runlog::RunData data = runlog::read_run(folder_ / "run");
  double nearest_m = 9;
  for (const runlog::PoseRow& pose : data.truth) nearest_m = std::min(nearest_m, std::hypot(pose.x_m - 1, pose.y_m));
  // By the estimate, the robot is within 0.1 m. The estimate has the smoothed error of fixes with pixels that are four
  // times as coarse.
  EXPECT_LT(nearest_m, 0.3);
  EXPECT_GT(data.truth.back().y_m, -1.0);
}

}  // namespace
}  // namespace twocone::runs
