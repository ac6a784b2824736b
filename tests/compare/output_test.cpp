// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/compare/compare.h"
#include "tests/compare/a_comparison.h"

namespace twocone::compare {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Returns a comparison with the longest possible numbers and names.
Comparison a_wide_comparison() {
  Comparison c = a_comparison();
  Source& wide = c.sources[2];
  wide.cause = Cause::kMirrorsAlignment, wide.view.reset();
  for (const char* const axis : {"x", "y"}) {
    wide.components.push_back(
        {std::string("upper.axis_offset_minus_lower_m.") + axis, "grey", -123456.789, 123456.789, 1234.567});
  }
  wide.confusable = {"lower rolling shutter", "upper rolling shutter", "lower focal length",
                     "upper focal length",    "mirrors' heights",      "wheel separation"};
  wide.shares = {
      {Quantity::kRange, 0.71}, {Quantity::kOdometry, -0.02}, {Quantity::kBrightness, 0.5}, {Quantity::kNoise, 1}};
  c.sources.back().reason =
      "the drive does not determine upper.azimuth_minus_lower_rad (both runs), upper.axis_offset_minus_lower_m.x (both "
      "runs), upper.axis_offset_minus_lower_m.y (real run)";
  c.notes.push_back(
      "the images are of different size (320 x 240 and 640 x 480 px): colours are not compared, and so "
      "on and on, as notes of devices sometimes do");
  Row row{Stage::kDetection, "difference of the paths per metre (RPE), rms", "mm", -12345678, -12345678, 3, 1234567};
  row.limit_key = "missed-percent", row.limit = 0.125, row.light = Light::kCannotTell;
  c.rows.push_back(row);
  c.gaps.back().unnamed = 0.83;
  return c;
}

TEST(CompareTable, FitsATerminal) {
  constexpr std::size_t kColumns = 100;
  for (const Comparison& comparison : {a_comparison(), a_wide_comparison(), Comparison{}}) {
    std::istringstream lines(table(comparison));
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), kColumns) << line;
  }
}

TEST(CompareTable, ReportsTheDifferencesAndWhatIsNotDetermined) {
  const std::string text = table(a_comparison());
  EXPECT_THAT(text, testing::ContainsRegex("lower.rim_radius_px +214.0 -> +216.0 +\\+2.000 \\+- 0.100 px"));
  EXPECT_THAT(text, HasSubstr("explains 71 % of the gap in range, -2 % of the gap in odometry"));
  EXPECT_THAT(text, HasSubstr("hardly distinguishes it from lower tilt"));
  EXPECT_THAT(text, HasSubstr("3 sources tested at 0.0003 each, 0.001 for all; 1 agree, 1 cannot be determined."));
  EXPECT_THAT(text, HasSubstr("cannot tell rolling shutter: the robot never turned fast enough"));
  EXPECT_THAT(text, testing::ContainsRegex("range, mm +9.200 +1.100 +0.900 +3 %"));
  EXPECT_THAT(text, testing::ContainsRegex("lower rim, radius, px +214.0 +216.0 +0.080 +1 amber"));
  EXPECT_THAT(table(a_wide_comparison()),
              HasSubstr("83 % of it is corrected by numbers of the calibration that no source"));
  EXPECT_THAT(text, Not(HasSubstr("gain.lower"))) << "sources that agree are not listed";
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(CompareTable, ReportsThatNoDifferenceWasFound) {
  Comparison c = a_comparison();
  for (Source& source : c.sources) source.verdict = SourceVerdict::kAgrees;
  EXPECT_THAT(table(c), HasSubstr("No difference found."));
}

TEST(CompareJson, HoldsEverySourceRowAndGap) {
  const Comparison c = a_wide_comparison();
  const auto json = nlohmann::json::parse(to_json(c));
  ASSERT_EQ(json["sources"].size(), c.sources.size());
  for (std::size_t i = 0; i < c.sources.size(); ++i) {
    EXPECT_EQ(json["sources"][i]["name"], c.sources[i].name());
    EXPECT_EQ(json["sources"][i]["verdict"], to_string(c.sources[i].verdict));
    EXPECT_EQ(json["sources"][i]["p_value"].get<double>(), c.sources[i].p_value);
    ASSERT_EQ(json["sources"][i]["components"].size(), c.sources[i].components.size());
    for (std::size_t k = 0; k < c.sources[i].components.size(); ++k) {
      const auto& component = json["sources"][i]["components"][k];
      EXPECT_EQ(component["real"].get<double>() - component["simulated"].get<double>(),
                component["difference"].get<double>());
      EXPECT_EQ(component["sigma"].get<double>(), c.sources[i].components[k].sigma);
    }
    EXPECT_EQ(json["sources"][i]["shares"].size(), c.sources[i].shares.size());
  }
  ASSERT_EQ(json["rows"].size(), c.rows.size());
  EXPECT_TRUE(json["rows"][3]["simulated"].is_null()) << "unknown is not 0";
  EXPECT_EQ(json["rows"][0]["light"], "amber");
  EXPECT_EQ(json["rows"].back()["light"], "cannot tell");
  EXPECT_EQ(json["limits"]["missed-percent"].get<double>(), 0.125);
  ASSERT_EQ(json["gaps"].size(), c.gaps.size());
  EXPECT_TRUE(json["gaps"][1]["unexplained"].is_null());
  EXPECT_EQ(json["gaps"][1]["unnamed"], 0.83);
  EXPECT_EQ(json["within_limits"], false);
  EXPECT_EQ(json["level"].get<double>(), c.level);
  EXPECT_EQ(json["simulated"], c.simulated) << "unchanged, with its quotes";
}

TEST(CompareJson, HoldsPathsResidualsAndTheMap) {
  const Comparison c = a_comparison();
  const auto json = nlohmann::json::parse(to_json(c));
  constexpr double kHalf = 0.5e-6;  // numbers are rounded to a millionth
  const auto& real = json["paths"]["real"];
  ASSERT_EQ(real["x_m"].size(), c.real_path.size());
  EXPECT_NEAR(real["y_m"][7].get<double>(), c.real_path[7].y_m, kHalf);
  const auto& points = json["residuals"]["real"];
  ASSERT_EQ(points["landmark"].size(), c.real_residuals.size());
  EXPECT_EQ(points["landmark"][1], 1);
  EXPECT_NEAR(points["before_m"][1].get<double>(), c.real_residuals[1].before_m, kHalf);
  EXPECT_NEAR(points["after_m"][1].get<double>(), c.real_residuals[1].after_m.value(), kHalf);
  EXPECT_TRUE(json["residuals"]["simulated"]["after_m"][1].is_null());
  EXPECT_EQ(json["map"]["landmarks"][0]["name"], "<red>");
  EXPECT_EQ(json["rows"][0]["limit_key"], "rim_px");
}

TEST(CompareJson, HoldsAtMostTwoThousandResidualsAndStatesItsStep) {
  Comparison c = a_comparison();
  const std::vector<ResidualPoint> few = c.real_residuals;
  while (c.real_residuals.size() < 6000) c.real_residuals.insert(c.real_residuals.end(), few.begin(), few.end());
  const auto points = nlohmann::json::parse(to_json(c))["residuals"]["real"];
  const auto landmarks = points["landmark"].get<std::vector<int>>();
  EXPECT_EQ(points["every"], 3);
  EXPECT_EQ(points["t_s"].size(), c.real_residuals.size() / 3);
  EXPECT_EQ(std::ranges::count(landmarks, 0), std::ranges::count(landmarks, 1)) << "of each landmark";
}

TEST(CompareJson, WritesNumbersThatAreNotFiniteAsNull) {
  Comparison c = a_comparison();
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  c.gaps.front() = {Quantity::kRange, "mm", nan, inf, -1, nan};
  c.rows.front().simulated = nan;
  c.simulated_path.front().x_m = nan;
  c.real_residuals.front().before_m = inf;
  const auto json = nlohmann::json::parse(to_json(c));
  EXPECT_TRUE(json["gaps"][0]["before"].is_null() && json["gaps"][0]["after"].is_null());
  EXPECT_TRUE(json["rows"][0]["simulated"].is_null());
  EXPECT_TRUE(json["paths"]["simulated"]["x_m"][0].is_null());
  EXPECT_TRUE(json["residuals"]["real"]["before_m"][0].is_null());
}

TEST(CompareJson, IsWithinLimitsWhereNoLightIsAmberOrRed) {
  Comparison c = a_comparison();
  EXPECT_FALSE(c.is_within_limits());
  for (Row& row : c.rows) row.light = Light::kGreen;
  EXPECT_TRUE(c.is_within_limits());
  c.rows.back().light = Light::kNone;
  EXPECT_TRUE(c.is_within_limits()) << "no limit is not broken";
  c.rows.back().light = Light::kAmber;
  EXPECT_FALSE(c.is_within_limits());
}

}  // namespace
}  // namespace twocone::compare
