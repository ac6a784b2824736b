// SPDX-License-Identifier: Apache-2.0
// Checks `estimator:` of a robot file.
#include <gtest/gtest.h>

#include "apps/config/robot_file.h"
#include "tests/config/fixtures.h"

namespace twocone::config {
namespace {

/// Returns the good robot with an `estimator:` whose first key is on line 57.
std::string text_with(const std::string& keys) { return good_robot_text() + "estimator:\n" + keys + "\n"; }

TEST(EstimatorKeys, AreThoseOfTheFile) {
  const EstimatorKeys keys = parsed_robot(text_with("  method: outline\n"
                                                    "  stage: adaptive\n"
                                                    "  landmarks: [red, 'light blue', \"3\"]\n"
                                                    "  bearings: false\n"
                                                    "  enough_m: 0.0031\n"
                                                    "  budget_s: 0.023"))
                                 .estimator;
  EXPECT_EQ(keys.method, "outline");
  EXPECT_EQ(keys.stage, "adaptive");
  EXPECT_EQ(keys.landmarks, (std::vector<std::string>{"red", "light blue", "3"}));
  EXPECT_FALSE(keys.bearings);
  EXPECT_EQ(keys.enough_m, 0.0031);
  EXPECT_EQ(keys.budget_s, 0.023);
}

TEST(EstimatorKeys, OfAFileWithoutThemAreTheMostAccurate) {
  EXPECT_EQ(parsed_robot(good_robot_text()).estimator, EstimatorKeys{});
  EXPECT_EQ(parsed_robot(text_with("  stage: adaptive")).estimator.enough_m, EstimatorKeys{}.enough_m);
  EXPECT_EQ(parsed_robot(text_with("  stage: adaptive")).estimator.budget_s, std::nullopt);
  for (const char* stage : {"found", "coarse", "fine", "adaptive"}) {
    EXPECT_EQ(parsed_robot(text_with(fmt::format("  stage: {}", stage))).estimator.stage, stage);
  }
  // The fewest landmarks, and the method that has no stages.
  const EstimatorKeys paper = parsed_robot(text_with("  method: paper\n  landmarks: [c, b, a]")).estimator;
  EXPECT_EQ(paper.method, "paper");
  EXPECT_EQ(paper.landmarks, (std::vector<std::string>{"c", "b", "a"}));
}

/// Keys and the complete error message for them.
struct BadKeys {
  const char* name;
  const char* keys;
  const char* message;

  friend void PrintTo(const BadKeys& bad, std::ostream* out) { *out << bad.name; }
};

class BadEstimator : public testing::TestWithParam<BadKeys> {};

TEST_P(BadEstimator, IsRefusedInTheseWords) {
  EXPECT_EQ(message_of([] { parsed_robot(text_with(GetParam().keys)); }), GetParam().message);
}

const BadKeys kBadEstimatorKeys[] = {
    {"Unknown", "  stages: fine",
     "robot.yaml:57: estimator.stages is unknown, did you mean stage? (known here: method, stage, landmarks, "
     "bearings, enough_m, budget_s, plan)"},
    {"UnitForgotten", "  stage: adaptive\n  budget: 0.02",
     "robot.yaml:58: estimator.budget is unknown, did you mean budget_s? (known here: method, stage, "
     "landmarks, bearings, enough_m, budget_s, plan)"},
    {"NoMapping", "  fast", "robot.yaml:56: estimator is 'fast', must be a mapping"},
    {"UnknownMethod", "  method: fast", "robot.yaml:57: estimator.method is 'fast', must be paper or outline"},
    {"EmptyMethod", "  method: ''", "robot.yaml:57: estimator.method is '', must be text that is not empty"},
    {"UnknownStage", "  stage: finest",
     "robot.yaml:57: estimator.stage is 'finest', must be found, coarse, fine or adaptive"},
    {"UnknownStageWithBudget", "  stage: adaptiv\n  budget_s: 0.02",
     "robot.yaml:57: estimator.stage is 'adaptiv', must be found, coarse, fine or adaptive"},
    {"StageOfPaper", "  method: paper\n  stage: fine",
     "robot.yaml:58: estimator.stage is 'fine', must be absent with method: paper"},
    {"BearingsOfPaper", "  method: paper\n  bearings: false",
     "robot.yaml:58: estimator.bearings is 'false', must be absent with method: paper"},
    {"BudgetOfPaper", "  method: paper\n  budget_s: 0.02",
     "robot.yaml:58: estimator.budget_s is 0.02 s, must be absent without stage: adaptive"},
    {"BearingsInWords", "  bearings: no", "robot.yaml:57: estimator.bearings is 'no', must be true or false"},
    {"LandmarksInOneWord", "  landmarks: red", "robot.yaml:57: estimator.landmarks is 'red', must be a list of texts"},
    {"TwoLandmarks", "  landmarks: [red, green]",
     "robot.yaml:57: estimator.landmarks is ['red', 'green'], must be a list of 3 names or more"},
    {"NoLandmarks", "  landmarks: []",
     "robot.yaml:57: estimator.landmarks is a list of 0, must be a list of 3 names or more"},
    {"OneLandmarkTwice", "  landmarks: [red, green, blue, red]",
     "robot.yaml:57: estimator.landmarks is ['red', 'green', 'blue', 'red'], must be a list without "
     "repetition: 'red' is in it twice"},
    {"LandmarkOfNoName", "  landmarks: [red, {}, blue]",
     "robot.yaml:57: estimator.landmarks[1] is a mapping, must be text that is not empty"},
    {"NothingIsEnough", "  stage: adaptive\n  enough_m: 0", "robot.yaml:58: estimator.enough_m is 0 m, must be > 0"},
    {"EnoughOfAWord", "  stage: adaptive\n  enough_m: little",
     "robot.yaml:58: estimator.enough_m is 'little', must be a number (metres)"},
    {"NoTime", "  stage: adaptive\n  budget_s: 0", "robot.yaml:58: estimator.budget_s is 0 s, must be > 0"},
    {"AllTime", "  stage: adaptive\n  budget_s: .inf",
     "robot.yaml:58: estimator.budget_s is .inf s, must be a finite number (seconds)"},
    {"EnoughForAll", "  enough_m: 0.002",
     "robot.yaml:57: estimator.enough_m is 0.002 m, must be absent without stage: adaptive"},
    {"BudgetOfFine", "  stage: fine\n  budget_s: 0.02",
     "robot.yaml:58: estimator.budget_s is 0.02 s, must be absent without stage: adaptive"}};

INSTANTIATE_TEST_SUITE_P(Keys, BadEstimator, testing::ValuesIn(kBadEstimatorKeys), name_of<BadKeys>);

}  // namespace
}  // namespace twocone::config
