// SPDX-License-Identifier: Apache-2.0
#include "apps/report/table.h"

#include <algorithm>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/apps/synthetic_run.h"

namespace twocone::report {
namespace {

using testing::HasSubstr;
using testing::Not;

runs::Summary known_summary() {
  runs::Summary summary;
  summary.method = "full";
  summary.frames = 450;
  summary.duration_s = 29.9333;
  summary.landmarks = {{"Red",
                        {{"ok", 423}, {"truncated", 20}, {"no_match", 7}},
                        runs::ErrorStatistics{423, 0.0123456, 0.015, 0.0301, 0.0602},
                        2.5},
                       {"lamp", {{"not_seen", 450}}, {}, 3.0}};
  summary.fix_verdicts = {{"ok", 440}, {"ambiguous", 4}, {"too_few", 6}};
  summary.frames_with_fix = 444;
  summary.fix_error = runs::ErrorStatistics{444, 0.0211, 0.025, 0.0444, 0.1234};
  summary.odometry_error = runs::ErrorStatistics{450, 0.0801, 0.09, 0.1601, 0.1752};
  summary.travelled_m = 11.234;
  summary.headings_covered_deg = 350;
  return summary;
}

runs::RunInfo known_info() { return synthetic_run("unused", 450).info; }

/// The line that begins with `head`.
std::string line_of(const std::string& table, const std::string& head) {
  std::istringstream stream(table);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with(head)) return line;
  }
  return "no line begins with " + head;
}

void expect_plain_and_narrow(const std::string& table) {
  std::istringstream stream(table);
  for (std::string line; std::getline(stream, line);) {
    EXPECT_LE(line.size(), 100U) << line;
    EXPECT_TRUE(std::all_of(line.begin(), line.end(), [](unsigned char c) { return c >= 0x20 && c < 0x7F; })) << line;
  }
}

TEST(Table, GivesKnownNumbersInMillimetresBesideThePapers) {
  const std::string text = table(known_summary(), known_info(), synthetic_robot());
  EXPECT_EQ(line_of(text, "Red "), "Red              423   94.0 %    12.35    15.00    30.10    60.20 |  21.95 136.6");
  EXPECT_EQ(line_of(text, "fix "), "fix              444   98.7 %    21.10    25.00    44.40   123.40 |  29.97   130");
  EXPECT_EQ(line_of(text, "odometry "), "odometry         450  100.0 %    80.10    90.00   160.10   175.20");
  EXPECT_EQ(line_of(text, "lamp "), "lamp               0    0.0 %        -        -        -        - |")
      << "no range is no number, and the paper knows no such pillar";
  EXPECT_THAT(text, HasSubstr("  Red         truncated 20, no_match 7\n"));
  EXPECT_THAT(text, HasSubstr("Frames by verdict: ok 440, too_few 6, ambiguous 4\n"));
  expect_plain_and_narrow(text);
}

TEST(Table, BeginsWithWhatRepeatsIt) {
  const std::string text = table(known_summary(), known_info(), synthetic_robot());
  EXPECT_TRUE(
      text.starts_with("twocone 0.1.0, commit 3f2c1ab, GNU 12.2.0\n"
                       "robot lab, behaviour wander, method full, seed 7\n"
                       "450 of 450 frames, 29.93 s, 11.23 m driven, headings covered: 350 of 360 degrees\n"
                       "repeat: twocone run --robot robots/lab_sim.yaml"))
      << text;
  EXPECT_THAT(text, HasSubstr("--seed 7\n"));
  EXPECT_THAT(text, Not(HasSubstr("cut off")));
}

TEST(Table, PutsTheBaselineBeside) {
  runs::Summary baseline = known_summary();
  baseline.landmarks[0].error = runs::ErrorStatistics{400, 0.0222, 0.03, 0.06, 0.0987};
  baseline.fix_error = runs::ErrorStatistics{400, 0.0333, 0.04, 0.08, 0.1111};
  const std::string text = table(known_summary(), known_info(), synthetic_robot(), &baseline);
  EXPECT_EQ(line_of(text, "Red "),
            "Red              423   94.0 %    12.35    15.00    30.10    60.20 |    22.20    98.70 |  21.95 136.6");
  EXPECT_EQ(line_of(text, "fix "),
            "fix              444   98.7 %    21.10    25.00    44.40   123.40 |    33.30   111.10 |  29.97   130");
  expect_plain_and_narrow(text);
}

TEST(Table, GivesNoErrorWithoutTruth) {
  runs::RunData run = synthetic_run("unused", 60);
  remove_truth(run);
  const std::string text = table(runs::summarise(run), run.info, run.robot);
  EXPECT_THAT(text, HasSubstr("no ground truth"));
  for (const char* word : {"mean", "rmse", " mm", "the paper", "nan", "driven"})
    EXPECT_THAT(text, Not(HasSubstr(word)));
  EXPECT_THAT(line_of(text, "cyan "), HasSubstr("%"));
  expect_plain_and_narrow(text);
}

TEST(Table, SaysWhenARunWasCutOff) {
  runs::RunInfo info = known_info();
  info.finished = false;
  runs::Summary summary = known_summary();
  summary.frames = 312;
  const std::string text = table(summary, info, synthetic_robot());
  EXPECT_THAT(text, HasSubstr("cut off"));
  EXPECT_THAT(text, HasSubstr("312 of 450 frames"));
}

TEST(Table, StandsNoFramesAtAll) {
  runs::RunData run = synthetic_run("unused", 0);
  const std::string text = table(runs::summarise(run), run.info, run.robot);
  EXPECT_THAT(text, HasSubstr("0 of 0 frames"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  expect_plain_and_narrow(text);
}

TEST(Table, StaysPlainAndNarrowWhateverTheNames) {
  runs::RunData run = synthetic_run("unused", 40);
  const std::string name = "Litfa\u00dfs\u00e4ule am \u2192 Nordeingang des langen Flurs <&\"'>";
  for (runs::RangeRow& row : run.ranges) {
    if (row.landmark == "red") row.landmark = name;
  }
  run.map.landmarks[0].name = name;
  run.robot.name = std::string(150, 'r');
  run.robot.file = "a directory with blanks/" + std::string(120, 'd') + "/robot's.yaml";
  run.info.compiler = "a compiler\nwith a line break";
  const runs::Summary summary = runs::summarise(run);
  const std::string text = table(summary, run.info, run.robot, &summary);
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    // A single word that is longer than a line stays whole: a command that cannot be pasted is of no use.
    if (line.find(std::string(100, 'd')) != std::string::npos || line.find(std::string(100, 'r')) != std::string::npos)
      continue;
    expect_plain_and_narrow(line);
  }
  EXPECT_THAT(text, HasSubstr("\nLitfa?s?u..  "));
}

TEST(RepeatCommand, IsQuotedForTheShell) {
  files::Robot robot = synthetic_robot();
  robot.file = "my robot's/lab.yaml";
  EXPECT_EQ(repeat_command(known_info(), robot, "paper"),
            "twocone run --robot 'my robot'\\''s/lab.yaml' --behaviour wander --frames 450 --method paper --seed 7");
}

}  // namespace
}  // namespace twocone::report
