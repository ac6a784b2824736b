// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tradeoff/output.h"
#include "apps/tradeoff/wording.h"
#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

void expect_plain_and_narrow(const std::string& text) {
  for (const std::string& line : lines_of(text)) {
    EXPECT_LE(line.size(), 120U) << line;
    EXPECT_TRUE(std::all_of(line.begin(), line.end(), [](unsigned char c) { return c >= 0x20 && c < 0x7F; })) << line;
  }
}

/// Returns the line after `head`.
std::string line_after(const std::string& text, const std::string& head) {
  const std::vector<std::string> lines = lines_of(text);
  const auto found = std::find(lines.begin(), lines.end(), head);
  return found == lines.end() || found + 1 == lines.end() ? "no line is " + head : *(found + 1);
}

/// Returns the rows of the frontier, between the heads and the baseline.
std::vector<std::string> frontier_rows(const std::string& text) {
  std::vector<std::string> rows;
  bool inside = false;
  for (const std::string& line : lines_of(text)) {
    if (line == "method paper, as measured here:") break;
    if (inside) rows.push_back(line);
    inside |= line.find("   size ") != std::string::npos;
  }
  return rows;
}

TEST(Table, BeginsWithTheCommandThatRepeatsItAndTheRule) {
  const std::string text = table(a_sweep());
  EXPECT_THAT(text,
              StartsWith("twocone 0.7.0, commit 0123abc, GNU 12.2.0, Release\n"
                         "robot robots/lab.yaml, map scenes/lab.yaml, seed 1, 24 episodes, 82 settings\n"
                         "machine: a processor, 2 cores\n"
                         "repeat: twocone tradeoff --robot robots/lab.yaml --seed 1 --episodes 24 --out tradeoff\n"));
  EXPECT_LT(text.find("Rule: a setting is on a frontier if it answers at least 90 %"), text.find("size"));
  EXPECT_THAT(text, HasSubstr("exact to 1e-9 m"));
  EXPECT_THAT(text, HasSubstr("Frames of one episode are not"));
  expect_plain_and_narrow(text);
}

TEST(Table, ShowsEverySettingOfAFrontierByRisingSimulationTime) {
  const Sweep sweep = a_sweep();
  const std::vector<std::string> rows = frontier_rows(table(sweep));
  std::vector<const SettingResult*> wanted;
  for (const SettingResult& result : sweep.settings) {
    if (result.on_robot_frontier || result.on_simulation_frontier) wanted.push_back(&result);
  }
  std::sort(wanted.begin(), wanted.end(),
            [](const auto* a, const auto* b) { return a->simulation_time_s().value < b->simulation_time_s().value; });
  ASSERT_EQ(rows.size(), wanted.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Setting& setting = wanted[i]->setting;
    EXPECT_EQ(rows[i].substr(0, 2),
              std::string(wanted[i]->on_robot_frontier ? "R" : " ") + (wanted[i]->on_simulation_frontier ? "S" : " "));
    EXPECT_THAT(rows[i].substr(3),
                StartsWith(std::to_string(setting.images.width_px) + "x" + std::to_string(setting.images.height_px)));
    EXPECT_THAT(rows[i], HasSubstr(" " + significant(wanted[i]->position_m->mean.value * 1e3) + " "));
  }
}

TEST(Table, BearingsOfMethodPaperAreNotUsed) {
  EXPECT_THAT(line_after(table(a_sweep()), "method paper, as measured here:"), HasSubstr("scene paper     6  no "));
}

TEST(Table, ShowsTheBaselineAtTheRobotsOwnSizeAndTheUnchangedRobotFile) {
  Sweep sweep = a_sweep();
  const std::string text = table(sweep);
  EXPECT_THAT(line_after(text, "method paper, as measured here:"), HasSubstr("640x480   -   scene paper"));
  EXPECT_EQ(
      line_after(text, "the robot file, unchanged:"),
      "   640x480   -   scene fine      6 yes  15x1  0.313   0.285-0.341  0.719   1.06  100 94.0  0.252 1.84 0.01 "
      "2.13 0.62 113");
  sweep.settings[*sweep.as_is].setting.images.effects = Effects::kNoise;  // not swept with method paper
  EXPECT_THAT(line_after(table(sweep), "method paper, as measured here:"), HasSubstr(" 640x480 ")) << "its own size";
  sweep.as_is = std::nullopt;
  EXPECT_THAT(line_after(table(sweep), "method paper, as measured here:"), HasSubstr("1280x960  +R2 scene paper"))
      << "the most accurate";
  EXPECT_EQ(table(sweep).find("the robot file, unchanged"), std::string::npos);
}

TEST(Table, CountsSettingsAxesAndSpans) {
  const std::string text = table(a_sweep());
  EXPECT_THAT(text,
              HasSubstr("82 settings over 8 axes (size, antialias, effects, estimator, landmarks, bearings, rate, "
                        "frames)"));
  const auto span = span_of(a_sweep());
  ASSERT_TRUE(span);
  EXPECT_THAT(text, HasSubstr(std::to_string(span->settings) + " of simulation time"));
  EXPECT_THAT(text, HasSubstr("a factor of " + std::to_string(std::lround(span->most_error_m / span->least_error_m)) +
                              " in error"));
}

TEST(Table, StaysNarrowWhateverTheNumbersAndNames) {
  Sweep sweep = a_sweep();
  sweep.robot = "robots/Ro\u00df <b>.yaml";
  sweep.repeat = "twocone tradeoff --robot " + std::string(60, 'r') + " --out " + std::string(60, 'o') + " --seed 1";
  double factor = 1e-9;
  for (SettingResult& result : sweep.settings) {
    factor *= 3;
    result.on_robot_frontier = true;
    if (result.position_m) {
      result.position_m->mean = {factor, factor / 3, factor * 7};
      result.position_m->max = 99 * factor;
    }
    result.bound_m = factor / 1e3;
    result.vision.median_s.value = factor;
    result.robot.p95_s.value = factor * 2;
    result.render_cpu.median_s.value = factor * 1e3;
    result.peak_bytes = 1e8;
  }
  sweep.settings[5].position_m->mean.high = std::numeric_limits<double>::infinity();
  expect_plain_and_narrow(table(sweep));
  EXPECT_THAT(table(sweep), HasSubstr("Ro? <b>"));
  EXPECT_THAT(table(sweep),
              HasSubstr("repeat: twocone tradeoff --robot " + std::string(60, 'r') + " \\\n          --out"));
}

TEST(Table, ReportsWhenNothingIsOnAFrontier) {
  Sweep sweep = a_sweep();
  sweep.settings.erase(sweep.settings.begin(), sweep.settings.end() - 1);  // the one that never answers
  sweep.as_is = std::nullopt;
  const std::string text = table(sweep);
  EXPECT_THAT(text, HasSubstr("no setting answers often enough"));
  EXPECT_EQ(text.find("method paper, as measured"), std::string::npos);
}

TEST(Wording, ANumberFitsItsColumn) {
  EXPECT_EQ(significant(0.0312345), "0.0312");
  EXPECT_EQ(significant(312.345), "312");
  EXPECT_EQ(significant(0), "0");
  EXPECT_EQ(significant(std::numeric_limits<double>::infinity()), "-");
  EXPECT_EQ(fitting(0.0312345, 6), "0.0312");
  EXPECT_EQ(fitting(0.0312345, 5), "0.031");
  EXPECT_EQ(fitting(0.0000312, 4), "0.00");
  EXPECT_EQ(fitting(1234567, 5), "1e+06");
}

// ---- CSV

using Row = std::vector<std::string>;

std::vector<Row> rows_of(const std::string& csv) {
  std::vector<Row> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    Row row(1);
    for (const char c : line) {
      if (c == ',') {
        row.emplace_back();
      } else {
        row.back() += c;
      }
    }
    rows.push_back(row);
  }
  return rows;
}

/// Returns the cells of a row by the names in the head; empty if two columns have the same name.
std::map<std::string, std::string> named(const std::vector<Row>& rows, std::size_t row) {
  std::map<std::string, std::string> cells;
  for (std::size_t i = 0; i < rows[0].size(); ++i) {
    if (!cells.emplace(rows[0][i], rows[row].at(i)).second) return {};
  }
  return cells;
}

TEST(Csv, HasTheColumnsThatOutputHStates) {
  const std::string csv = errors_csv(a_sweep());
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "width_px,height_px,antialias,effects,estimator,enough_m,landmarks,bearings,rate_hz,frames,frames_observed,"
            "answered,position_mean_m,position_mean_low_m,position_mean_high_m,position_rmse_m,position_rmse_low_m,"
            "position_rmse_high_m,position_p95_m,position_p95_low_m,position_p95_high_m,position_max_m,"
            "heading_mean_rad,heading_mean_low_rad,heading_mean_high_rad,heading_rmse_rad,heading_rmse_low_rad,"
            "heading_rmse_high_rad,heading_p95_rad,heading_p95_low_rad,heading_p95_high_rad,heading_max_rad,"
            "range_mean_m,range_mean_low_m,range_mean_high_m,range_rmse_m,range_rmse_low_m,range_rmse_high_m,"
            "range_p95_m,range_p95_low_m,range_p95_high_m,range_max_m,coverage,coverage_low,coverage_high,bound_m");
  const std::string all = tradeoff_csv(a_sweep());
  EXPECT_EQ(all.substr(csv.find('\n'), all.find('\n') - csv.find('\n')),
            ",render_median_s,render_median_low_s,render_median_high_s,render_spread_s,render_p95_s,render_p95_low_s,"
            "render_p95_high_s,vision_median_s,vision_median_low_s,vision_median_high_s,vision_spread_s,vision_p95_s,"
            "vision_p95_low_s,vision_p95_high_s,localisation_median_s,localisation_median_low_s,"
            "localisation_median_high_s,localisation_spread_s,localisation_p95_s,localisation_p95_low_s,"
            "localisation_p95_high_s,robot_median_s,robot_median_low_s,robot_median_high_s,robot_spread_s,robot_p95_s,"
            "robot_p95_low_s,robot_p95_high_s,simulation_s,simulation_low_s,simulation_high_s,peak_bytes,render_bytes,"
            "robot_frontier,simulation_frontier");
}

TEST(Csv, HasARowForEachSettingAndACellForEachColumn) {
  const Sweep sweep = a_sweep();
  for (const std::string& csv : {errors_csv(sweep), tradeoff_csv(sweep)}) {
    const std::vector<Row> rows = rows_of(csv);
    ASSERT_THAT(rows, SizeIs(sweep.settings.size() + 1));
    for (const Row& row : rows) EXPECT_EQ(row.size(), rows[0].size());
  }
}

TEST(Csv, NumbersComeBackAsTheSameDouble) {
  Sweep sweep = a_sweep();
  const double odd_m = 0.1 + 0.2;  // has 17 digits
  sweep.settings[3].position_m->mean = {odd_m, 1e-9 / 3, 1.0 / 3};
  sweep.settings[3].vision.spread_s = 1e-4 / 7;
  auto row = named(rows_of(tradeoff_csv(sweep)), 4);
  EXPECT_EQ(row["position_mean_m"], "0.30000000000000004");
  EXPECT_EQ(std::stod(row["position_mean_low_m"]), 1e-9 / 3);
  EXPECT_EQ(std::stod(row["position_mean_high_m"]), 1.0 / 3);
  EXPECT_EQ(std::stod(row["vision_spread_s"]), 1e-4 / 7);
  EXPECT_EQ(row["rate_hz"], "15");
  EXPECT_EQ(row["estimator"], "fine");
}

TEST(Csv, BearingsOfMethodPaperAreNotUsed) {
  const std::vector<Row> rows = rows_of(errors_csv(a_sweep()));
  auto paper = named(rows, 1), fine = named(rows, 4);
  ASSERT_EQ(paper["estimator"], "paper");
  EXPECT_EQ(paper["bearings"], "0");
  ASSERT_EQ(fine["estimator"], "fine");
  EXPECT_EQ(fine["bearings"], "1");
}

TEST(Csv, AMissingNumberIsEmpty) {
  Sweep sweep = a_sweep();
  sweep.settings[0].position_m->mean.high = std::numeric_limits<double>::infinity();
  sweep.settings[0].position_m->rmse.value = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Row> rows = rows_of(errors_csv(sweep));
  auto paper = named(rows, 1);
  EXPECT_EQ(paper["estimator"], "paper");
  EXPECT_EQ(paper["position_mean_high_m"], "");
  EXPECT_EQ(paper["position_rmse_m"], "");
  EXPECT_NE(paper["position_mean_m"], "");
  EXPECT_EQ(paper["enough_m"], "");  // only adaptive has one
  EXPECT_EQ(paper["coverage"], "");
  EXPECT_EQ(paper["bound_m"], "");
  auto blind = named(rows, rows.size() - 1);
  EXPECT_EQ(blind["answered"], "0");
  EXPECT_EQ(blind["position_mean_m"], "");
  EXPECT_EQ(blind["heading_p95_low_rad"], "");
  EXPECT_EQ(blind["range_max_m"], "");
}

TEST(Csv, ErrorsDoNotDependOnTheMachinesSpeed) {
  const Sweep sweep = a_sweep();
  Sweep slower = sweep;
  for (SettingResult& result : slower.settings) {
    result.robot.p95_s.value *= 3;
    result.render_cpu.median_s.value *= 2;
    result.peak_bytes += 4096;
    result.on_robot_frontier = !result.on_robot_frontier;
  }
  EXPECT_EQ(errors_csv(slower), errors_csv(sweep));
  EXPECT_NE(tradeoff_csv(slower), tradeoff_csv(sweep));
}

TEST(Csv, ContainsFrontiersAndAdaptive) {
  const Sweep sweep = a_sweep();
  const std::vector<Row> rows = rows_of(tradeoff_csv(sweep));
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    auto row = named(rows, i + 1);
    EXPECT_EQ(row["robot_frontier"], sweep.settings[i].on_robot_frontier ? "1" : "0") << "row " << i;
    EXPECT_EQ(row["simulation_frontier"], sweep.settings[i].on_simulation_frontier ? "1" : "0") << "row " << i;
    EXPECT_EQ(row["enough_m"].empty(), row["estimator"] != "adaptive") << "row " << i;
  }
}

}  // namespace
}  // namespace twocone::tradeoff
