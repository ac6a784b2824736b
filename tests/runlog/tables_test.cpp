// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/tables.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing_support::error_of;
using testing_support::TemporaryFolder;

TEST(Tables, WhatIsWrittenIsReadAgainToTheBit) {
  const TemporaryFolder folder;
  RangeRow row;
  row.frame = 12;
  row.t_s = 0.1 + 0.2;
  row.landmark = "red, \"the\" one";
  row.verdict = "ok";
  row.range_m = 2.0 / 3;
  row.bearing_rad = -1e-17;
  const auto file = folder.write("ranges.csv", TableReader<RangeRow>::header() + '\n' + to_line(row) + '\n');
  const auto rows = read_table<RangeRow>(file);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].frame, 12U);
  EXPECT_EQ(rows[0].t_s, 0.1 + 0.2);
  EXPECT_EQ(rows[0].landmark, row.landmark);
  EXPECT_EQ(rows[0].range_m, row.range_m);
  EXPECT_EQ(rows[0].bearing_rad, row.bearing_rad);
  EXPECT_FALSE(rows[0].sigma_range_m);
  EXPECT_FALSE(rows[0].true_range_m);
}

TEST(Tables, HeadersAreThoseOfTheDesign) {
  EXPECT_EQ(TableReader<FrameRow>::header(),
            "frame,t_s,skew_s,lower_t_s,upper_t_s,lower_sequence,upper_sequence,lower_lost,upper_lost,host_t_s");
  EXPECT_EQ(TableReader<DriveRow>::header(), "t_s,left_command_radps,right_command_radps,left_rad,right_rad");
  EXPECT_EQ(TableReader<RangeRow>::header(),
            "frame,t_s,landmark,verdict,range_m,sigma_range_m,bearing_rad,sigma_bearing_rad,disparity_px,true_range_m");
  EXPECT_EQ(
      TableReader<FixRow>::header(),
      "frame,t_s,verdict,x_m,y_m,heading_rad,var_x_m2,cov_xy_m2,var_y_m2,var_heading_rad2,true_x_m,true_y_m,error_m,"
      "outliers,cov_x_heading_m_rad,cov_y_heading_m_rad,unseen_x,unseen_y,unseen_heading,"
      "own_var_x_m2,own_cov_xy_m2,own_var_y_m2,own_var_heading_rad2");
  EXPECT_EQ(TableReader<TrackRow>::header(),
            "frame,t_s,state,x_m,y_m,heading_rad,var_x_m2,cov_xy_m2,var_y_m2,cov_x_heading_m_rad,cov_y_heading_m_rad,"
            "var_heading_rad2,fix,use,plan");
  EXPECT_EQ(TableReader<SightingRow>::header(),
            "frame,t_s,landmark,view,column_px,row_px,var_column_px2,cov_px2,var_row_px2,edge_noise_px");
  EXPECT_EQ(TableReader<ScanRow>::header(), "frame,t_s,beam_rad,state,range_m,sigma_m");
  EXPECT_EQ(TableReader<TimingRow>::header(), "frame,t_s,vision_s,localisation_s,wall_s,refined,verdict");
}

TEST(Tables, TimingIsReadAgain) {
  const TemporaryFolder folder;
  const TimingRow row{7, 0.7, 0.1 / 3, 1e-5 / 7, 0.1, 4, "over"};
  const auto rows =
      read_table<TimingRow>(folder.write("timing.csv", TableReader<TimingRow>::header() + '\n' + to_line(row) + '\n'));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(to_line(rows[0]), to_line(row));
  EXPECT_EQ(rows[0].vision_s, 0.1 / 3);
  EXPECT_EQ(rows[0].refined, 4);
  EXPECT_EQ(rows[0].verdict, "over");
  EXPECT_TRUE(read_table<TimingRow>(folder.path() / "not_there.csv").empty()) << "an older run";
  const auto half = folder.write("half.csv", TableReader<TimingRow>::header() + "\n7,0.7,0.01,0.001,0.011,4.5,\n");
  EXPECT_EQ(error_of<config::FileError>([&] { (void)read_table<TimingRow>(half); }),
            half.string() + ":2: field 6 is '4.5', must be a number");
}

TEST(Tables, SightingsAndOutliersAreReadAgain) {
  const TemporaryFolder folder;
  const SightingRow sighting{7, 0.7, "red, too", "upper", 319.123456789, -0.5, 1e-3, -2e-5, 3e-3, 0.0625};
  const auto rows = read_table<SightingRow>(
      folder.write("sightings.csv", TableReader<SightingRow>::header() + '\n' + to_line(sighting) + '\n'));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(to_line(rows[0]), to_line(sighting));
  EXPECT_EQ(rows[0].landmark, "red, too");
  EXPECT_EQ(rows[0].cov_px2, -2e-5);
  EXPECT_TRUE(read_table<SightingRow>(folder.path() / "not_there.csv").empty()) << "a method without sightings";

  FixRow fix;
  fix.verdict = "ok";
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{}, {"red"}, {"a;b", "c\\", "d,\"e\""}, {"", "x"}, {"x", ""}}) {
    fix.outliers = names;
    const auto again =
        read_table<FixRow>(folder.write("fixes.csv", TableReader<FixRow>::header() + '\n' + to_line(fix) + '\n'));
    ASSERT_EQ(again.size(), 1U);
    EXPECT_EQ(again[0].outliers, names) << to_line(fix);
  }
}

// A run of an older version lacks this column and is still valid.
TEST(Tables, FixesOfAnOlderRunAreRead) {
  const TemporaryFolder folder;
  const std::string header = TableReader<FixRow>::header().substr(0, TableReader<FixRow>::header().find(",outliers"));
  const auto rows = read_table<FixRow>(folder.write("fixes.csv", header + "\n3,0.2,ok,1,2,,,,,,1,2,0.5\n"));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].error_m, 0.5);
  EXPECT_TRUE(rows[0].outliers.empty());
  const auto few = folder.write("few.csv", header + "\n3,0.2,ok\n");
  EXPECT_EQ(error_of<config::FileError>([&] { (void)read_table<FixRow>(few); }),
            few.string() + ":2: has 3 fields, must have 13");
  // The next version had outliers, and no unseen direction.
  const auto named =
      read_table<FixRow>(folder.write("named.csv", header + ",outliers\n3,0.2,weak,1,2,,,,,,1,2,0.5,red;blue\n"));
  ASSERT_EQ(named.size(), 1U);
  EXPECT_EQ(named[0].outliers.size(), 2U);
  EXPECT_FALSE(named[0].unseen_x);
  EXPECT_TRUE(read_table<TrackRow>(folder.path() / "not_there.csv").empty());
}

TEST(Tables, TheTrackIsReadAsItWasWritten) {
  const TemporaryFolder folder;
  TrackRow row{.frame = 7, .t_s = 0.5, .state = "tracking", .x_m = 1.5, .y_m = -0.5, .heading_rad = 0.1};
  row.var_x_m2 = 1e-6;
  row.cov_xy_m2 = -1e-7;
  row.var_y_m2 = 2e-6;
  row.cov_x_heading_m_rad = 3e-8;
  row.cov_y_heading_m_rad = -4e-8;
  row.var_heading_rad2 = 5e-7;
  row.fix = "weak";
  row.use = "taken";
  row.plan = "unexpected";
  const TrackRow nothing{.frame = 8, .t_s = 0.6, .state = "lost", .fix = "too_few", .use = "no_fix"};
  EXPECT_EQ(to_line(nothing), "8,0.6,lost,,,,,,,,,,too_few,no_fix,");
  const auto rows = read_table<TrackRow>(folder.write(
      "track.csv", TableReader<TrackRow>::header() + '\n' + to_line(row) + '\n' + to_line(nothing) + '\n'));
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(to_line(rows[0]),
            "7,0.5,tracking,1.5,-0.5,0.1,1e-06,-1e-07,2e-06,3e-08,-4e-08,5e-07,weak,taken,unexpected");
  EXPECT_EQ(to_line(rows[1]), to_line(nothing));
  EXPECT_EQ(pose_of(rows[0])->y_m, -0.5);
  EXPECT_FALSE(pose_of(rows[1]));
  row.heading_rad = 0.1 + 3e-10;
  EXPECT_EQ(to_line(row), to_line(rows[0])) << "kept to 1e-9 rad";
  std::string before_plans = TableReader<TrackRow>::header();
  before_plans.erase(before_plans.rfind(','));
  const auto older =
      read_table<TrackRow>(folder.write("older.csv", before_plans + "\n8,0.6,lost,,,,,,,,,,too_few,no_fix\n"));
  ASSERT_EQ(older.size(), 1U);
  EXPECT_EQ(to_line(older[0]), to_line(nothing));
}

TEST(Tables, FieldsThatDoNotApplyAreEmptyNeverZero) {
  FixRow row;
  row.frame = 3;
  row.t_s = 0.2;
  row.verdict = "too_few";
  EXPECT_EQ(to_line(row), "3,0.2,too_few,,,,,,,,,,,,,,,,,,,,");
}

TEST(Tables, AHalfWrittenLastLineIsLeftOut) {
  const TemporaryFolder folder;
  const auto file = folder.write("drive.csv", TableReader<DriveRow>::header() + "\n0,1,2,3,4\n0.5,1,2,3,4\n1.0,1,2");
  EXPECT_EQ(read_table<DriveRow>(file).size(), 2U);
  EXPECT_TRUE(read_table<DriveRow>(folder.write("half_header.csv", "t_s,left")).empty());
  EXPECT_TRUE(read_table<DriveRow>(folder.path() / "not_there.csv").empty());
}

TEST(Tables, AWrongLineIsNamed) {
  const TemporaryFolder folder;
  const auto wrong = folder.write("drive.csv", TableReader<DriveRow>::header() + "\n0,1,2,3,4\n0.5,1,two,3,4\n");
  EXPECT_EQ(error_of<config::FileError>([&] { (void)read_table<DriveRow>(wrong); }),
            wrong.string() + ":3: field 3 is 'two', must be a number");
  const auto few = folder.write("few.csv", TableReader<DriveRow>::header() + "\n0,1,2\n");
  EXPECT_EQ(error_of<config::FileError>([&] { (void)read_table<DriveRow>(few); }),
            few.string() + ":2: has 3 fields, must have 5");
  const auto header = folder.write("header.csv", "a,b\n0,1,2\n");
  EXPECT_EQ(error_of<config::FileError>([&] { (void)read_table<DriveRow>(header); }),
            header.string() + ":1: the first line must be " + TableReader<DriveRow>::header());
  const auto tum = folder.write("truth.tum", "0 1 2 0 0 0 0\n");
  EXPECT_EQ(error_of<config::FileError>([&] { (void)read_poses(tum); }),
            tum.string() + ":1: has 7 numbers, must have 8: t tx ty tz qx qy qz qw");
}

TEST(Tables, PosesKeepTheirHeading) {
  const TemporaryFolder folder;
  constexpr double kKept_rad = 1e-9;
  for (const double heading : {-3.1, -1.0, 0.0, 0.7, 3.1, std::numbers::pi}) {
    const auto file = folder.write("truth.tum", "# comment\n" + to_line(PoseRow{1.5, 0.1, -0.2, heading}) + "\n");
    const auto rows = read_poses(file);
    ASSERT_EQ(rows.size(), 1U);
    EXPECT_EQ(rows[0].x_m, 0.1);
    EXPECT_EQ(rows[0].y_m, -0.2);
    EXPECT_NEAR(std::remainder(rows[0].heading_rad - heading, 2 * std::numbers::pi), 0, kKept_rad);
    EXPECT_EQ(to_line(rows[0]), to_line(PoseRow{1.5, 0.1, -0.2, heading})) << "a second conversion gives the same text";
  }
}

}  // namespace
}  // namespace twocone::runlog
