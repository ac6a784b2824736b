// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tradeoff/output.h"
#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using testing::SizeIs;
using testing_support::a_sweep;

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
