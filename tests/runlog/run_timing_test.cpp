// SPDX-License-Identifier: Apache-2.0
// Checks the time and work of answers, from an answer to timing.csv and its statistics, and the settings kept in
// run.yaml.
#include "apps/runlog/summary/summary.h"

#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/tables/tables.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing_support::error_of;
using testing_support::TemporaryFolder;

const std::string kLab = TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml";
const std::string kMap = TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml";

TEST(TimeBudget, MakesARobotAdaptiveForARun) {
  config::Robot robot = config::read_robot(kLab);
  robot.estimator = {.method = "paper", .landmarks = {"red", "green", "blue"}, .enough_m = 0.007};
  const config::Robot changed = estimation::with_budget(robot, estimation::Method::kOutline, 0.0203);
  EXPECT_EQ(changed.estimator.method, "outline") << "with method paper the file could not be read";
  EXPECT_EQ(changed.estimator.stage, "adaptive");
  EXPECT_EQ(changed.estimator.budget_s, 0.0203);
  EXPECT_EQ(changed.estimator.enough_m, 0.007);
  EXPECT_EQ(changed.estimator.landmarks, robot.estimator.landmarks);
  EXPECT_EQ(estimation::time_limit_of(estimation::Method::kOutline, changed), 0.0203);
  EXPECT_EQ(estimation::time_limit_of(estimation::Method::kPaper, changed), std::nullopt) << "the baseline has none";
}

TEST(TimeBudget, IsRefusedWhereItCannotBeKept) {
  const auto refusal = [robot = config::read_robot(kLab)](estimation::Method method, double budget_s) {
    return error_of<std::invalid_argument>([&] { (void)estimation::with_budget(robot, method, budget_s); });
  };
  using enum estimation::Method;
  EXPECT_EQ(refusal(kPaper, 0.02), "method paper has no stages to stop at: a time budget needs method outline");
  EXPECT_EQ(refusal(kOutline, 0), "the time budget is 0 ms, must be > 0 ms and finite");
  EXPECT_EQ(refusal(kOutline, -0.25), "the time budget is -250 ms, must be > 0 ms and finite");
  EXPECT_EQ(refusal(kOutline, std::numeric_limits<double>::infinity()),
            "the time budget is inf ms, must be > 0 ms and finite");
  EXPECT_NE(refusal(kOutline, std::numeric_limits<double>::quiet_NaN()), "no error");
}

TEST(MethodOf, IsTheFilesOrTheDefault) {
  config::Robot robot;
  EXPECT_EQ(estimation::method_of(robot), estimation::kDefaultMethod);
  robot.estimator.method = "paper";
  EXPECT_EQ(estimation::method_of(robot), estimation::Method::kPaper);
}

TEST(TimingRow, HasAVerdictOnlyWithATimeBudget) {
  estimation::Timing timing{
      .vision_s = 0.01, .localisation_s = 0.001, .wall_s = 0.013, .refined = 4, .is_over_budget = false};
  EXPECT_EQ(to_line(to_row(7, 0.5, timing, false)), "7,0.5,0.01,0.001,0.013,4,");
  EXPECT_EQ(to_line(to_row(7, 0.5, timing, true)), "7,0.5,0.01,0.001,0.013,4,kept");
  timing.is_over_budget = true;
  EXPECT_EQ(to_line(to_row(7, 0.5, timing, true)), "7,0.5,0.01,0.001,0.013,4,over");
}

TEST(BudgetEvent, ReportsTheNumberAndTheWorst) {
  const std::vector<TimingRow> rows{{0, 0, 0.1, 0, 0.9, 0, "kept"},
                                    {1, 0, 0.1, 0, 0.0214, 0, "over"},
                                    {2, 0, 0.1, 0, 0.0312, 0, "over"},
                                    {3, 0, 0.1, 0, 0.0203, 0, "over"}};
  EXPECT_EQ(budget_event(rows, 0.02),
            "over time budget: 3 of 4 frames took longer than 20 ms, frame 2 the longest with 31.2 ms");
  EXPECT_EQ(budget_event({rows[0]}, 0.02), std::nullopt);
  EXPECT_EQ(budget_event({}, 0.02), std::nullopt);
}

/// Returns twenty frames: vision 20 down to 1 ms, localisation 1 to 20 ms, and one frame of 107 ms.
RunData run_with_timing() {
  RunData run;
  run.method = "outline";
  run.map = config::read_map(kMap);
  for (int i = 0; i < 20; ++i) {
    run.timing.push_back({std::uint64_t(i), 0, 1e-3 * (20 - i), 1e-3 * (i + 1), 0.05, i % 4, i < 17 ? "kept" : "over"});
  }
  run.timing[3].vision_s = 0.103;
  return run;
}

TEST(TimingSummary, IsOfAllFrames) {
  RunData run = run_with_timing();
  run.robot.estimator.stage = "adaptive";
  run.robot.estimator.budget_s = 0.03;
  const auto summary = summarise_timing(run);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->frames, 20);
  // Nearest ranks: the tenth of twenty, and the nineteenth of nineteen times 21 ms and once 107 ms.
  EXPECT_DOUBLE_EQ(summary->vision_median_s, 0.010);
  EXPECT_DOUBLE_EQ(summary->localisation_median_s, 0.010);
  EXPECT_DOUBLE_EQ(summary->both_p95_s, 0.021);
  EXPECT_DOUBLE_EQ(summary->refined_mean.value(), 1.5);
  EXPECT_EQ(summary->landmarks, int(run.map.landmarks.size()));
  EXPECT_EQ(summary->budget_s, 0.03);
  EXPECT_EQ(summary->kept, 17);

  run.robot.estimator.landmarks = {"red", "green", "blue"};
  EXPECT_EQ(summarise_timing(run)->landmarks, 3);
  run.robot.estimator.stage = "fine";
  EXPECT_EQ(summarise_timing(run)->budget_s, std::nullopt);
  run.method = "paper";
  EXPECT_EQ(summarise_timing(run)->refined_mean, std::nullopt) << "it has no stages";
  run.timing.clear();
  EXPECT_FALSE(summarise_timing(run)) << "a run of an older version";
}

/// A folder with a run of two frames, each with the timing of its answer.
class TimingOfARun : public testing::Test {
 protected:
  void SetUp() override {
    RunFolder folder(run_);
    const Image image{1, 1, PixelFormat::kRgb8, {1, 2, 3}};
    for (const std::uint64_t frame : {0, 1}) {
      FrameRecord record;
      record.frame.frame = frame;
      record.answer.timing = TimingRow{frame, 0.1 * double(frame), 0.01, 0.002, 0.0125, 3, "kept"};
      folder.add(record, image, image);
    }
    RunInfo info;
    info.method = "outline";
    config::Robot robot = config::read_robot(kLab);
    write_run_yaml(run_, info, estimation::with_budget(robot, estimation::Method::kOutline, 0.0203), kMap);
    file_results(run_, "outline");
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path run_ = temporary_.path() / "run";
};

TEST_F(TimingOfARun, IsReadAgain) {
  for (const char* method : {"", "outline"}) {
    const RunData run = read_run(run_, method);
    ASSERT_EQ(run.timing.size(), 2U) << method;
    EXPECT_EQ(to_line(run.timing[1]), "1,0.1,0.01,0.002,0.0125,3,kept");
  }
}

TEST_F(TimingOfARun, MayBeMissingFromAnOlderRun) {
  std::filesystem::remove(run_ / "timing.csv");
  const RunData run = read_run(run_);
  EXPECT_EQ(run.frames.size(), 2U);
  EXPECT_TRUE(run.timing.empty());
}

TEST_F(TimingOfARun, EndsWithTheLastFrame) {
  const std::string text = config::read_text(run_ / "timing.csv");
  (void)temporary_.write("run/timing.csv", text + "2,0.2,0.01,0.002,0.0125,3,kept\n");
  EXPECT_EQ(read_run(run_).timing.size(), 2U);
}

// Catches a run.yaml made from the file alone. localise would then work differently from the run.
TEST_F(TimingOfARun, BelongsToTheSettingsInRunYaml) {
  const config::EstimatorKeys keys = read_run(run_).robot.estimator;
  EXPECT_EQ(keys, (config::EstimatorKeys{.method = "outline", .stage = "adaptive", .budget_s = 0.0203}));
}

TEST_F(TimingOfARun, OfAnotherMethodTakesItsPlace) {
  AnswerRows answer;
  answer.fixes.resize(1);
  answer.timing = TimingRow{0, 0, 0.5, 0, 0.5, 0, ""};
  write_results(run_, "paper", {answer}, OnTop::kYes);
  EXPECT_EQ(read_table<TimingRow>(run_ / "timing.csv").size(), 1U);
  EXPECT_EQ(read_table<TimingRow>(run_ / "methods" / "paper" / "timing.csv").at(0).vision_s, 0.5);
  EXPECT_EQ(read_table<TimingRow>(run_ / "methods" / "outline" / "timing.csv").size(), 2U);
}

// A key of the file that the run has overridden must not come back.
TEST(RunYaml, KeepsTheEstimatorOfTheRunNotOfTheFile) {
  const TemporaryFolder folder;
  std::string text = config::read_text(kLab);
  text.replace(text.find("../scenes/lab.map.yaml"), std::string("../scenes/lab.map.yaml").size(), kMap);
  config::Robot robot = config::read_robot(
      folder.write("robot.yaml", text + "estimator: {method: paper, landmarks: [red, green, blue]}\n"));
  const auto kept = [&] {
    write_run_yaml(folder.path(), {}, robot, kMap);
    return read_run_yaml(folder.path()).robot.estimator;
  };
  EXPECT_EQ(kept(), robot.estimator);
  EXPECT_EQ(kept().method, "paper");
  robot = estimation::with_budget(robot, estimation::Method::kOutline, 0.1 / 3);
  EXPECT_EQ(kept(), robot.estimator);
  robot.estimator = {};
  EXPECT_EQ(kept(), config::EstimatorKeys{});
}

}  // namespace
}  // namespace twocone::runlog
