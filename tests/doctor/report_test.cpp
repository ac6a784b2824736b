// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/report.h"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::doctor {
namespace {

using testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

Report three_rows() {
  Report report;
  report.add({"lower", "rate", "24.95 Hz of 25"});
  report.add({"pair", "skew", "median 11.0 ms, at most 12.0 ms; limit 10 ms", kFailed, "max_skew_s: 0.02"});
  report.add(
      {"drive", "moving tests", "no user can confirm that the wheels are free, nor was it stated", kNotRun,
       "lift both wheels and run it in a terminal, or with --wheels-off-the-ground, which is as good as an answer"});
  return report;
}

TEST(DoctorReport, ColumnsAreAlignedAndFitTheWidth) {
  const auto lines = lines_of(table(three_rows()));
  ASSERT_GE(lines.size(), 5U);
  const std::size_t verdict = lines[0].find("verdict");
  EXPECT_EQ(lines[1].substr(verdict), "ok");
  EXPECT_EQ(lines[2].substr(verdict, 6), "failed");
  EXPECT_EQ(lines[3].substr(verdict, 7), "not run");
  for (const std::string& line : lines) {
    EXPECT_LE(line.size(), 120U) << line;
    EXPECT_NE(line.back(), ' ') << line;
  }
}

TEST(DoctorReport, LongCellsContinueAndLoseNoWord) {
  std::string words;
  for (const std::string& line : lines_of(table(three_rows()))) words += line + " ";
  std::istringstream in("no user can confirm that the wheels are free nor was it stated lift as good as an answer");
  for (std::string word; in >> word;) EXPECT_THAT(words, HasSubstr(word));
}

TEST(DoctorReport, APathThatFitsNoColumnIsNotBroken) {
  const std::string path = "/dev/v4l/by-id/usb-Maker_Camera_with_a_very_long_name_0123456789ABCDEF-video-index0";
  Report report;
  report.add({"lower", "opens", "no", kFailed, "device: " + path});
  EXPECT_THAT(table(report), HasSubstr(path));
}

TEST(DoctorReport, SummaryCounts) {
  EXPECT_EQ(summary(three_rows()), "1 ok, 0 warnings, 1 failed, 1 not run");
  EXPECT_TRUE(three_rows().has_failed());
  Report fine;
  fine.add({"lower", "rate", "25 Hz"});
  EXPECT_EQ(summary(fine), "all 1 checks ok");
  fine.add({"lower", "age", "90 ms", kWarning, "less load"});
  EXPECT_EQ(summary(fine), "1 ok, 1 warning, 0 failed, 0 not run");
  EXPECT_FALSE(fine.has_failed());
}

}  // namespace
}  // namespace twocone::doctor
