// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <algorithm>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/report/kit/plain_text.h"
#include "tests/report/synthetic_run.h"

namespace twocone::report {
namespace {

using testing::HasSubstr;
using testing::Not;

runlog::Summary known_summary() {
  runlog::Summary summary;
  summary.method = "outline";
  summary.frames = 450;
  summary.duration_s = 29.9333;
  summary.landmarks = {{"Red",
                        {{"ok", 423}, {"truncated", 20}, {"no_match", 7}},
                        runlog::ErrorStatistics{423, 0.0123456, 0.015, 0.0301, 0.0602},
                        2.5},
                       {"lamp", {{"not_seen", 450}}, {}, 3.0}};
  summary.landmarks[0].frames_with_range = 423;
  summary.fix_verdicts = {{"ok", 440}, {"ambiguous", 4}, {"too_few", 6}};
  summary.frames_with_fix = 444;
  summary.fix_error = runlog::ErrorStatistics{444, 0.0211, 0.025, 0.0444, 0.1234};
  summary.odometry_error = runlog::ErrorStatistics{450, 0.0801, 0.09, 0.1601, 0.1752};
  summary.travelled_m = 11.234;
  summary.headings_covered_deg = 350;
  return summary;
}

runlog::RunInfo known_info() { return synthetic_run("unused", 450).info; }

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

TEST(Table, NamesTheFixesThatTheTrackDidNotTake) {
  runlog::Summary summary = known_summary();
  summary.track_uses = {{"taken", 430}, {"no_fix", 6}, {"started", 1}};
  EXPECT_THAT(table(summary, known_info(), synthetic_robot()), Not(HasSubstr("did not take")));
  summary.track_uses["unexpected"] = 9;
  summary.track_uses["out_of_bounds"] = 4;
  const std::string text = table(summary, known_info(), synthetic_robot());
  EXPECT_EQ(line_of(text, "Fixes that"), "Fixes that the track did not take: unexpected 9, out_of_bounds 4");
}

TEST(Table, GivesKnownNumbersInMillimetresBesideThePapers) {
  const std::string text = table(known_summary(), known_info(), synthetic_robot());
  EXPECT_EQ(line_of(text, "Red "), "Red              423   94.0 %    12.35    15.00    30.10    60.20 |  21.95 136.6");
  EXPECT_EQ(line_of(text, "fix "), "fix              444   98.7 %    21.10    25.00    44.40   123.40 |  29.97   130");
  EXPECT_EQ(line_of(text, "odometry "), "odometry         450  100.0 %    80.10    90.00   160.10   175.20");
  EXPECT_EQ(line_of(text, "lamp "), "lamp               0    0.0 %        -        -        -        - |")
      << "no range gives no number, and the paper has no such landmark";
  EXPECT_THAT(text, HasSubstr("  Red         truncated 20, no_match 7\n"));
  EXPECT_THAT(text, HasSubstr("Frames by verdict: ok 440, too_few 6, ambiguous 4\n"));
  expect_plain_and_narrow(text);
}

// Catches a wild answer that shifts all other columns.
TEST(Table, KeepsItsColumnsWhateverTheNumbers) {
  runlog::Summary ours = known_summary();
  runlog::Summary paper = known_summary();
  paper.fix_error = runlog::ErrorStatistics{444, 678568836725369472.0, 999.9999, 9999.9994, 1e305};
  ours.landmarks[0].error = runlog::ErrorStatistics{423, 99.99994, 99.999996, 123.4, 1e9};
  const std::string text = table(ours, known_info(), synthetic_robot(), &paper);
  EXPECT_EQ(line_of(text, "Red "),
            "Red              423   94.0 % 99999.94  1.0e+05  1.2e+05  1.0e+12 |    12.35    60.20 |  21.95 136.6");
  EXPECT_EQ(line_of(text, "fix "),
            "fix              444   98.7 %    21.10    25.00    44.40   123.40 |  6.8e+20 1.0e+308 |  29.97   130");
  expect_plain_and_narrow(text);
}

TEST(Table, BeginsWithWhatRepeatsIt) {
  const std::string text = table(known_summary(), known_info(), synthetic_robot());
  EXPECT_TRUE(
      text.starts_with("twocone 0.1.0, commit 3f2c1ab, GNU 12.2.0\n"
                       "robot lab, behaviour wander, method outline, seed 7\n"
                       "450 of 450 frames, 29.93 s, 11.23 m driven, headings covered: 350 of 360 degrees\n"
                       "repeat: twocone run --robot robots/lab_sim.yaml"))
      << text;
  EXPECT_THAT(text, HasSubstr("--seed 7\n"));
  EXPECT_THAT(text, Not(HasSubstr("cut off")));
}

TEST(Table, PutsTheBaselineBeside) {
  runlog::Summary baseline = known_summary();
  baseline.landmarks[0].error = runlog::ErrorStatistics{400, 0.0222, 0.03, 0.06, 0.0987};
  baseline.fix_error = runlog::ErrorStatistics{400, 0.0333, 0.04, 0.08, 0.1111};
  const std::string text = table(known_summary(), known_info(), synthetic_robot(), &baseline);
  EXPECT_EQ(line_of(text, "Red "),
            "Red              423   94.0 %    12.35    15.00    30.10    60.20 |    22.20    98.70 |  21.95 136.6");
  EXPECT_EQ(line_of(text, "fix "),
            "fix              444   98.7 %    21.10    25.00    44.40   123.40 |    33.30   111.10 |  29.97   130");
  expect_plain_and_narrow(text);
}

// Widths and units by hand: 0.0018 m are 1.80 mm, 0.0003 rad are 0.0172 degrees.
TEST(Table, PutsBoundsHeadingsAndTheEstimateBeside) {
  runlog::Summary summary = known_summary();
  summary.landmarks[0].range_bound_m = runlog::BoundComparison{420, 0.0018, 0.00234};
  summary.landmarks[0].within_95 = runlog::Share{400, 423};
  summary.landmarks[0].outliers = 3;
  summary.position_bound_m = runlog::BoundComparison{444, 0.0009, 0.0010};
  summary.in_ellipse_95 = runlog::Share{421, 444};
  summary.heading_error = runlog::ErrorStatistics{444, 0.0002, 0.0003, 0.0006, 0.0008};
  summary.heading_bound_rad = runlog::BoundComparison{444, 0.00025, 0.0003};
  summary.estimate_error = runlog::ErrorStatistics{450, 0.0005, 0.0006, 0.0012, 0.002};
  summary.estimate_heading_error = runlog::ErrorStatistics{450, 0.0001, 0.0001, 0.0002, 0.0004};
  const std::string text = table(summary, known_info(), synthetic_robot());
  EXPECT_EQ(line_of(text, "estimate "), "estimate         450  100.0 %     0.50     0.60     1.20     2.00");
  const std::string headings = text.substr(text.find("Heading, error in degrees"));
  EXPECT_EQ(line_of(headings, "fix "), "fix              444   98.7 %   0.0115   0.0172   0.0344   0.0458");
  EXPECT_EQ(line_of(headings, "estimate "), "estimate         450  100.0 %   0.0057   0.0057   0.0115   0.0229");
  const std::string bounds = text.substr(text.find("Beside the Cramer-Rao bound"));
  EXPECT_EQ(line_of(bounds, "Red "), "Red              420     2.34     1.80     1.30   94.6 % of 423");
  EXPECT_EQ(line_of(bounds, "lamp "), "lamp               0        -        -        -        -");
  EXPECT_EQ(line_of(bounds, "position "), "position         444     1.00     0.90     1.11   94.8 % of 444");
  EXPECT_EQ(line_of(bounds, "heading "), "heading          444   0.0172   0.0143     1.20");
  EXPECT_THAT(text, HasSubstr("Left out of fixes as outliers, in frames: Red 3\n"));
  expect_plain_and_narrow(text);
}

TEST(Table, OfMethodOutlineStatesCorrectSigmas) {
  const runlog::RunData run = outline_run(synthetic_run("unused", 160));
  const runlog::Summary summary = runlog::summarise(run);
  ASSERT_TRUE(summary.position_bound_m && summary.position_bound_m->ratio());
  // About 155 fixes with errors of two numbers each: their root mean square is off by 1 / sqrt(2 * 155) = 5.7 % of
  // itself at most; three times that. The share of 95 % is off by sqrt(0.95 * 0.05 / 155) = 1.8 %; three times that.
  EXPECT_NEAR(*summary.position_bound_m->ratio(), 1, 0.17);
  ASSERT_TRUE(summary.in_ellipse_95);
  EXPECT_NEAR(double(summary.in_ellipse_95->held) / summary.in_ellipse_95->count, 0.95, 0.054);
  EXPECT_EQ(summary.landmarks[2].outliers, 1);
  const std::string text = table(summary, run.info, run.robot);
  EXPECT_THAT(text, HasSubstr("Beside the Cramer-Rao bound"));
  expect_plain_and_narrow(text);
}

TEST(Table, GivesNoErrorWithoutTruth) {
  runlog::RunData run = synthetic_run("unused", 60);
  remove_truth(run);
  const std::string text = table(runlog::summarise(run), run.info, run.robot);
  EXPECT_THAT(text, HasSubstr("no ground truth"));
  for (const char* word : {"mean", "rmse", " mm", "the paper", "nan", "driven"})
    EXPECT_THAT(text, Not(HasSubstr(word)));
  EXPECT_THAT(line_of(text, "cyan "), HasSubstr("%"));
  expect_plain_and_narrow(text);
}

TEST(Table, ReportsWhenARunWasCutOff) {
  runlog::RunInfo info = known_info();
  info.finished = false;
  runlog::Summary summary = known_summary();
  summary.frames = 312;
  const std::string text = table(summary, info, synthetic_robot());
  EXPECT_THAT(text, HasSubstr("cut off"));
  EXPECT_THAT(text, HasSubstr("312 of 450 frames"));
}

TEST(Table, HandlesNoFramesAtAll) {
  runlog::RunData run = synthetic_run("unused", 0);
  const std::string text = table(runlog::summarise(run), run.info, run.robot);
  EXPECT_THAT(text, HasSubstr("0 of 0 frames"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  expect_plain_and_narrow(text);
}

TEST(Table, StaysPlainAndNarrowWhateverTheNames) {
  runlog::RunData run = synthetic_run("unused", 40);
  const std::string name = "Litfa\u00dfs\u00e4ule am \u2192 Nordeingang des langen Flurs <&\"'>";
  for (runlog::RangeRow& row : run.ranges) {
    if (row.landmark == "red") row.landmark = name;
  }
  run.map.landmarks[0].name = name;
  run.robot.name = std::string(150, 'r');
  run.robot.file = "a directory with blanks/" + std::string(120, 'd') + "/robot's.yaml";
  run.info.compiler = "a compiler\nwith a line break";
  const runlog::Summary summary = runlog::summarise(run);
  const std::string text = table(summary, run.info, run.robot, &summary);
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    // A single word longer than a line stays whole, so that the command can be pasted.
    if (line.find(std::string(100, 'd')) != std::string::npos || line.find(std::string(100, 'r')) != std::string::npos)
      continue;
    expect_plain_and_narrow(line);
  }
  EXPECT_THAT(text, HasSubstr("\nLitfa?s?u..  "));
}

TEST(Table, ReportsTheTimesOfVisionAndLocalisation) {
  runlog::RunData run = synthetic_run("unused", 40);
  run.method = "outline";
  for (const runlog::FrameRow& frame : run.frames) {
    run.timing.push_back({frame.frame, frame.t_s, 0.01234, 0.000567, 0.0131, 3, frame.frame < 38 ? "kept" : "over"});
  }
  run.robot.estimator.stage = "adaptive";
  run.robot.estimator.budget_s = 0.02;
  std::vector<std::string> notes;
  const std::string text = table_of(run, notes);
  EXPECT_EQ(text.find("searched for"), std::string::npos) << "all were";
  EXPECT_THAT(text, HasSubstr("\nTime per frame: vision median 12.34 ms, localisation median 0.57 ms,\n"
                              "  95 % of both together within 12.91 ms; refined 3.00 landmarks of 6 on average;\n"
                              "  time budget of 20 ms kept in 38 of 40 frames\n"));
  expect_plain_and_narrow(text);

  run.robot.estimator.landmarks = {"red", "green", "blue"};
  const std::string fewer = table_of(run, notes);
  EXPECT_THAT(fewer, HasSubstr("\nOnly these landmarks were searched for: red, green, blue\n"));
  EXPECT_THAT(fewer, HasSubstr("refined 3.00 landmarks of 3 on average"));

  run.method = "paper";
  EXPECT_EQ(line_of(table_of(run, notes), "  95 %"), "  95 % of both together within 12.91 ms")
      << "no stages, no time budget";
  run.timing.clear();
  EXPECT_EQ(table_of(run, notes).find("Time per frame"), std::string::npos) << "a run of an older version";
}

TEST(RepeatCommand, NamesTheTimeBudget) {
  config::Robot robot = synthetic_robot();
  robot.estimator.stage = "adaptive";
  // Not every number of milliseconds survives the division by 1000 and the way back.
  for (const char* const ms : {"20", "0.3", "20.3", "33.3333333333", "1e-05"}) {
    robot.estimator.budget_s = std::stod(ms) / 1000;
    EXPECT_EQ(repeat_command(known_info(), robot, "outline"),
              fmt::format("twocone run --robot robots/lab_sim.yaml --behaviour wander --frames 450 --method outline "
                          "--budget-ms {} --seed 7",
                          ms));
  }
  EXPECT_EQ(repeat_command(known_info(), robot, "paper").find("--budget-ms"), std::string::npos)
      << "the command would reject it";
  robot.estimator.budget_s.reset();
  EXPECT_EQ(repeat_command(known_info(), robot, "outline").find("--budget-ms"), std::string::npos);
}

TEST(RepeatCommand, NamesTruthAndPace) {
  runlog::RunInfo info = known_info();
  info.truth = info.real_time = true;
  EXPECT_TRUE(repeat_command(info, synthetic_robot(), "outline").ends_with(" --seed 7 --truth --real-time"));
  info.maps = true;
  EXPECT_TRUE(repeat_command(info, synthetic_robot(), "outline").ends_with(" --real-time --landmarks none"));
}

TEST(RepeatCommand, IsQuotedForTheShell) {
  config::Robot robot = synthetic_robot();
  robot.file = "my robot's/lab.yaml";
  EXPECT_EQ(repeat_command(known_info(), robot, "paper"),
            "twocone run --robot 'my robot'\\''s/lab.yaml' --behaviour wander --frames 450 --method paper --seed 7");
}

TEST(RepeatCommand, OfAnImportedRunIsNoRun) {
  runlog::RunInfo info = known_info();
  info.behaviour = runlog::kImported;
  EXPECT_EQ(repeat_command(info, synthetic_robot(), "paper"), "twocone localise RUN --method paper");
  info.import_options = {"--robot", "/r.yaml", "--lower", "/my cam"};
  EXPECT_EQ(repeat_command(info, synthetic_robot(), "paper"),
            "twocone import --robot /r.yaml --lower '/my cam' --out RUN && twocone localise RUN --method paper");
}

// Letters of any language can be pasted; control characters are written as their bytes.
TEST(RepeatCommand, KeepsLettersAndNoControlCharacters) {
  EXPECT_EQ(shell_word("robots/Käthe.yaml"), "'robots/Käthe.yaml'");
  EXPECT_EQ(shell_word("日本/r.yaml"), "'日本/r.yaml'");
  EXPECT_EQ(shell_word("a\x1b[2J'\\"), "$'a\\x1b[2J\\x27\\x5c'");
  EXPECT_EQ(shell_word("a\xc2\x9b"), "$'a\\xc2\\x9b'") << "a control character of 8 bits";
  EXPECT_EQ(shell_word("a\xff"), "$'a\\xff'");
  config::Robot robot = synthetic_robot();
  robot.file = "Käthe.yaml";
  EXPECT_NE(
      table(known_summary(), known_info(), robot, nullptr, nullptr).find("repeat: twocone run --robot 'Käthe.yaml'"),
      std::string::npos);
}

}  // namespace
}  // namespace twocone::report
