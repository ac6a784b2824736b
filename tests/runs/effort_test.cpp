// SPDX-License-Identifier: Apache-2.0
// What answers took: from an answer to effort.csv, and what is said of it; and run.yaml's memory of what was asked for.
#include "apps/runs/effort.h"

#include <limits>

#include <gtest/gtest.h>

#include "apps/files/text_file.h"
#include "apps/runs/run_folder.h"
#include "apps/runs/run_yaml.h"
#include "apps/runs/tables.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runs {
namespace {

using testing_support::TemporaryFolder;

const std::string kLab = TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml";
const std::string kMap = TWOCONE_SOURCE_DIR "/scenes/lab.map.yaml";

std::string error_of(const auto& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(Budget, MakesARobotAdaptiveForARun) {
  files::Robot robot = files::read_robot(kLab);
  robot.estimator = {.method = "paper", .landmarks = {"red", "green", "blue"}, .enough_m = 0.007};
  const files::Robot changed = with_budget(robot, Method::kFull, 0.0203);
  EXPECT_EQ(changed.estimator.method, "full") << "with paper its file could not be read";
  EXPECT_EQ(changed.estimator.stage, "adaptive");
  EXPECT_EQ(changed.estimator.budget_s, 0.0203);
  EXPECT_EQ(changed.estimator.enough_m, 0.007);
  EXPECT_EQ(changed.estimator.landmarks, robot.estimator.landmarks);
  EXPECT_EQ(budget_of(Method::kFull, changed), 0.0203);
  EXPECT_EQ(budget_of(Method::kPaper, changed), std::nullopt) << "the baseline beside it has none";
}

TEST(Budget, IsRefusedWhereItCannotBeKept) {
  const files::Robot robot = files::read_robot(kLab);
  EXPECT_EQ(error_of([&] { (void)with_budget(robot, Method::kPaper, 0.02); }),
            "method paper has no stages to stop at: a budget needs method full");
  EXPECT_EQ(error_of([&] { (void)with_budget(robot, Method::kFull, 0); }),
            "the budget is 0 ms, must be > 0 ms and finite");
  EXPECT_EQ(error_of([&] { (void)with_budget(robot, Method::kFull, -0.25); }),
            "the budget is -250 ms, must be > 0 ms and finite");
  EXPECT_EQ(error_of([&] { (void)with_budget(robot, Method::kFull, std::numeric_limits<double>::infinity()); }),
            "the budget is inf ms, must be > 0 ms and finite");
  EXPECT_NE(error_of([&] { (void)with_budget(robot, Method::kFull, std::numeric_limits<double>::quiet_NaN()); }),
            "no error");
}

TEST(MethodOf, IsTheFilesOrTheDefault) {
  files::Robot robot;
  EXPECT_EQ(method_of(robot), kDefaultMethod);
  robot.estimator.method = "paper";
  EXPECT_EQ(method_of(robot), Method::kPaper);
}

TEST(EffortRow, HasAVerdictOnlyWithABudget) {
  Effort effort{.vision_s = 0.01, .localisation_s = 0.001, .wall_s = 0.013, .refined = 4, .is_over_budget = false};
  EXPECT_EQ(to_line(to_row(7, 0.5, effort, false)), "7,0.5,0.01,0.001,0.013,4,");
  EXPECT_EQ(to_line(to_row(7, 0.5, effort, true)), "7,0.5,0.01,0.001,0.013,4,kept");
  effort.is_over_budget = true;
  EXPECT_EQ(to_line(to_row(7, 0.5, effort, true)), "7,0.5,0.01,0.001,0.013,4,over");
}

TEST(BudgetEvent, TellsHowManyAndTheWorst) {
  const std::vector<EffortRow> rows{{0, 0, 0.1, 0, 0.9, 0, "kept"},
                                    {1, 0, 0.1, 0, 0.0214, 0, "over"},
                                    {2, 0, 0.1, 0, 0.0312, 0, "over"},
                                    {3, 0, 0.1, 0, 0.0203, 0, "over"}};
  EXPECT_EQ(budget_event(rows, 0.02),
            "over budget: 3 of 4 frames took longer than 20 ms, frame 2 the longest with 31.2 ms");
  EXPECT_EQ(budget_event({rows[0]}, 0.02), std::nullopt);
  EXPECT_EQ(budget_event({}, 0.02), std::nullopt);
}

/// Twenty frames: vision 20 down to 1 ms, localisation 1 to 20 ms, but one frame of 107 ms.
RunData run_with_effort() {
  RunData run;
  run.method = "full";
  run.map = files::read_map(kMap);
  for (int i = 0; i < 20; ++i) {
    run.effort.push_back({std::uint64_t(i), 0, 1e-3 * (20 - i), 1e-3 * (i + 1), 0.05, i % 4, i < 17 ? "kept" : "over"});
  }
  run.effort[3].vision_s = 0.103;
  return run;
}

TEST(EffortSummary, IsOfAllFrames) {
  RunData run = run_with_effort();
  run.robot.estimator.stage = "adaptive";
  run.robot.estimator.budget_s = 0.03;
  const auto summary = summarise_effort(run);
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
  EXPECT_EQ(summarise_effort(run)->landmarks, 3);
  run.robot.estimator.stage = "fine";
  EXPECT_EQ(summarise_effort(run)->budget_s, std::nullopt);
  run.method = "paper";
  EXPECT_EQ(summarise_effort(run)->refined_mean, std::nullopt) << "it has no stages";
  run.effort.clear();
  EXPECT_FALSE(summarise_effort(run)) << "a run of an older version";
}

/// A folder with a run of two frames, each with what its answer took.
class EffortOfARun : public testing::Test {
 protected:
  void SetUp() override {
    RunFolder folder(run_);
    const Image picture{1, 1, PixelFormat::kRgb8, {1, 2, 3}};
    for (const std::uint64_t frame : {0, 1}) {
      FrameRecord record;
      record.frame.frame = frame;
      record.answer.effort = EffortRow{frame, 0.1 * double(frame), 0.01, 0.002, 0.0125, 3, "kept"};
      folder.add(record, picture, picture);
    }
    RunInfo info;
    info.method = "full";
    files::Robot robot = files::read_robot(kLab);
    write_run_yaml(run_, info, with_budget(robot, Method::kFull, 0.0203), kMap);
    file_results(run_, "full");
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path run_ = temporary_.path() / "run";
};

TEST_F(EffortOfARun, IsReadAgain) {
  for (const char* method : {"", "full"}) {
    const RunData run = read_run(run_, method);
    ASSERT_EQ(run.effort.size(), 2U) << method;
    EXPECT_EQ(to_line(run.effort[1]), "1,0.1,0.01,0.002,0.0125,3,kept");
  }
}

TEST_F(EffortOfARun, MayBeMissingFromAnOlderRun) {
  std::filesystem::remove(run_ / "effort.csv");
  const RunData run = read_run(run_);
  EXPECT_EQ(run.frames.size(), 2U);
  EXPECT_TRUE(run.effort.empty());
}

TEST_F(EffortOfARun, EndsWithTheLastFrame) {
  const std::string text = files::read_text(run_ / "effort.csv");
  (void)temporary_.write("run/effort.csv", text + "2,0.2,0.01,0.002,0.0125,3,kept\n");
  EXPECT_EQ(read_run(run_).effort.size(), 2U);
}

// Catches a run.yaml of the file alone: localise would then work otherwise than the run did.
TEST_F(EffortOfARun, BelongsToWhatWasAskedForAsRunYamlKeepsIt) {
  const files::EstimatorKeys keys = read_run(run_).robot.estimator;
  EXPECT_EQ(keys, (files::EstimatorKeys{.method = "full", .stage = "adaptive", .budget_s = 0.0203}));
}

TEST_F(EffortOfARun, OfAnotherMethodTakesItsPlace) {
  AnswerRows answer;
  answer.fixes.resize(1);
  answer.effort = EffortRow{0, 0, 0.5, 0, 0.5, 0, ""};
  write_results(run_, "paper", {answer}, OnTop::kYes);
  EXPECT_EQ(read_effort(run_ / "effort.csv").size(), 1U);
  EXPECT_EQ(read_effort(run_ / "methods" / "paper" / "effort.csv").at(0).vision_s, 0.5);
  EXPECT_EQ(read_effort(run_ / "methods" / "full" / "effort.csv").size(), 2U);
}

// What a file says of a robot that a run has otherwise must not come back.
TEST(RunYaml, KeepsTheEstimatorOfTheRunNotOfTheFile) {
  const TemporaryFolder folder;
  std::string text = files::read_text(kLab);
  text.replace(text.find("../scenes/lab.map.yaml"), std::string("../scenes/lab.map.yaml").size(), kMap);
  files::Robot robot = files::read_robot(
      folder.write("robot.yaml", text + "estimator: {method: paper, landmarks: [red, green, blue]}\n"));
  const auto kept = [&] {
    write_run_yaml(folder.path(), {}, robot, kMap);
    return read_run_yaml(folder.path()).robot.estimator;
  };
  EXPECT_EQ(kept(), robot.estimator);
  EXPECT_EQ(kept().method, "paper");
  robot = with_budget(robot, Method::kFull, 0.1 / 3);
  EXPECT_EQ(kept(), robot.estimator);
  robot.estimator = {};
  EXPECT_EQ(kept(), files::EstimatorKeys{});
}

}  // namespace
}  // namespace twocone::runs
