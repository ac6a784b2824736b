// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/compare/made_up_side.h"

namespace twocone::compare {
namespace {

constexpr double kGapRounding = 1e-9;

TEST(Light, GreenWithinTheLimitAmberWithinTwiceRedBeyond) {
  constexpr double kLimit = 0.3;
  const auto above = [](double value) { return std::nextafter(value, 1e9); };
  EXPECT_EQ(light_of(0, std::nullopt, kLimit), Light::kGreen);
  EXPECT_EQ(light_of(kLimit, std::nullopt, kLimit), Light::kGreen);
  EXPECT_EQ(light_of(above(kLimit), std::nullopt, kLimit), Light::kAmber);
  EXPECT_EQ(light_of(2 * kLimit, std::nullopt, kLimit), Light::kAmber);
  EXPECT_EQ(light_of(above(2 * kLimit), std::nullopt, kLimit), Light::kRed);
  EXPECT_EQ(light_of(0, std::nullopt, 0), Light::kGreen) << "a limit of 0 can be met";
  EXPECT_EQ(light_of(1e-300, std::nullopt, 0), Light::kRed);
}

TEST(Light, ASigmaAboveTheLimitCannotTellUnlessTheGapIsFarBeyond) {
  // The age of images in a comparison of two equal robots.
  EXPECT_EQ(light_of(23.84, 45.0, 20), Light::kCannotTell);
  EXPECT_EQ(light_of(0.1, 45.0, 20), Light::kCannotTell) << "within the limit by chance";
  EXPECT_EQ(light_of(23.84, 20.0, 20), Light::kAmber) << "a sigma equal to the limit still decides";
  EXPECT_EQ(light_of(20 + kCertain * 45 - 1, 45.0, 20), Light::kCannotTell);
  EXPECT_EQ(light_of(20 + kCertain * 45 + 1, 45.0, 20), Light::kRed);
}

TEST(Limits, EachHasItsOwnKeyADefaultAndADescription) {
  std::set<std::string> keys;
  for (const LimitKind& kind : limit_kinds()) {
    EXPECT_TRUE(keys.insert(kind.key).second) << kind.key << " occurs twice";
    EXPECT_GT(kind.by_default, 0) << kind.key;
    EXPECT_STRNE(kind.what, "") << kind.key;
  }
}

class Rows : public testing::Test {
 protected:
  Rows() {
    for (Side* const side : {&simulated_, &real_}) {
      side->run.map.landmarks = {{"red", {1, 0, 0}, -2, 0.3, 0.1, 0.9}};
      // Not a straight line, because paths on one line cannot be aligned.
      for (std::size_t i = 0; i < side->reference.size(); ++i) side->reference[i]->y_m = 0.01 * double(i % 5);
    }
    for (Residuals* const residuals : {&of_simulated_, &of_real_}) {
      residuals->frames = residuals->with_fix = residuals->looked_for = residuals->ranged = 40;
      residuals->has_range.assign(40, true);
    }
    for (std::size_t i = 0; i < 40; ++i) same_.push_back({i, i});
  }

  std::vector<Row> rows(const Limits& limits = {}) {
    const BothRuns runs{simulated_, real_, timing_of(simulated_.run), timing_of(real_.run), same_, same_};
    double level = 0;
    return find_rows(runs, of_simulated_, of_real_, find_sources(runs, {}, 1e-3, level), limits);
  }
  static const Row& row(const std::vector<Row>& rows, std::string_view name) {
    return element_of(rows, name, &Row::name);
  }

  Side simulated_ = made_up_side("sim_povray", made_up_result()), real_ = made_up_side("memory", made_up_result());
  Residuals of_simulated_, of_real_;
  std::vector<Match> same_;
};

TEST_F(Rows, EveryLimitIsUsedAndEveryKeyIsALimit) {
  std::set<std::string> known, used;
  for (const LimitKind& kind : limit_kinds()) known.insert(kind.key);
  for (const Row& r : rows()) {
    EXPECT_EQ(r.limit_key.empty(), !r.limit) << r.name;
    if (!r.limit_key.empty()) used.insert(r.limit_key);
    EXPECT_TRUE(r.light == Light::kNone || (r.gap && r.limit)) << r.name;
  }
  EXPECT_EQ(used, known);
}

TEST_F(Rows, OfTwoEqualRunsNoLightIsBeyondGreen) {
  const auto all = rows();
  EXPECT_GT(std::count_if(all.begin(), all.end(), [](const Row& r) { return r.light == Light::kGreen; }), 10);
  for (const Row& r : all) {
    // So few frames cannot determine a share of one per cent.
    const bool is_share = r.limit_key == "lost-percent";
    EXPECT_TRUE(r.light == Light::kNone || r.light == (is_share ? Light::kCannotTell : Light::kGreen)) << r.name;
  }
}

TEST_F(Rows, StagesFollowTheOrderFromImageToPose) {
  std::vector<std::string_view> stages;
  for (const Row& r : rows()) {
    if (stages.empty() || stages.back() != to_string(r.stage)) stages.push_back(to_string(r.stage));
  }
  EXPECT_THAT(stages, testing::ElementsAre("image", "detection", "disparity", "range", "bearing", "fix", "odometry",
                                           "trajectory", "timing"));
}

TEST_F(Rows, ReportGapsOfNumbersThatDiffer) {
  parameter(real_.calibration->result, "lower.rim_radius_px").after += 1.5;
  of_real_.range_m.add(0.050);
  of_simulated_.range_m.add(0.004);
  for (const std::size_t frame : {3, 7, 9}) of_real_.has_range[frame] = false;
  of_real_.ranged = 37, of_real_.outliers = 1;
  for (auto& pose : real_.reference) pose->x_m += 0.3;
  const auto all = rows();

  const Row& rim = row(all, "lower rim, radius");
  EXPECT_NEAR(*rim.gap, 1.5, kGapRounding);
  EXPECT_EQ(rim.light, Light::kAmber) << "limit 1 px";
  ASSERT_TRUE(rim.gap_sigma);
  const Row& range = row(all, "range error at the reference pose, rms");
  EXPECT_NEAR(*range.gap, 46, kGapRounding);
  EXPECT_EQ(range.light, Light::kRed) << "limit 20 mm";
  const Row& missed = row(all, "missed: ranged in the simulation only");
  EXPECT_NEAR(*missed.gap, 7.5, kGapRounding) << "3 of 40";
  EXPECT_EQ(missed.light, Light::kGreen) << "limit 10 %: matched frames are not exactly at one place";
  EXPECT_NEAR(*row(all, "false: ranges that the fix left out as wrong").gap, 100.0 / 37, kGapRounding);
  EXPECT_NEAR(*row(all, "distance of paths at equal times (APE), rms").gap, 300, 1e-6);
  EXPECT_NEAR(*row(all, "distance, aligned paths (APE, Umeyama), rms").gap, 0, 1e-6);
  EXPECT_EQ(row(all, "distance of paths at equal times (APE), rms").light, Light::kAmber) << "limit 200 mm";
}

TEST_F(Rows, ANumberWhoseSigmaExceedsItsLimitIsReportedAsUnknown) {
  const Row sure = row(rows(), "lower rim, radius");
  ASSERT_TRUE(sure.gap_sigma);
  ASSERT_EQ(sure.light, Light::kGreen);
  const auto all = rows({{"rim-px", *sure.gap_sigma / 2}});
  EXPECT_EQ(row(all, "lower rim, radius").light, Light::kCannotTell);
}

TEST_F(Rows, ALimitOfTheUserReplacesTheDefault) {
  parameter(real_.calibration->result, "lower.rim_radius_px").after += 1.5;
  const auto all = rows({{"rim-px", 2.0}});
  EXPECT_EQ(*row(all, "lower rim, radius").limit, 2.0);
  EXPECT_EQ(row(all, "lower rim, radius").light, Light::kGreen);
  EXPECT_EQ(*row(all, "lower centre, row").limit, 1.0) << "others stay";
}

TEST_F(Rows, AMissingNumberHasAReasonAndNoLight) {
  real_.calibration.reset();
  real_.why_no_calibration = "too dark";
  same_.clear();
  const auto all = rows();
  const Row& rim = row(all, "lower rim, radius");
  EXPECT_EQ(rim.note, "too dark");
  EXPECT_EQ(rim.light, Light::kNone);
  EXPECT_FALSE(rim.real);
  EXPECT_EQ(row(all, "missed: ranged in the simulation only").note, "no frames at the same place");
  EXPECT_EQ(row(all, "distance of paths at equal times (APE), rms").note,
            "too few frames at equal times with a reference");
}

TEST_F(Rows, TheFrameRatesLimitIsInPercent) {
  for (auto& frame : real_.run.frames) frame.t_s *= 1.03;
  const auto all = rows();
  const Row& rate = row(all, "frame rate");
  EXPECT_NEAR(*rate.gap, 100 - 100 / 1.03, 1e-6);
  EXPECT_EQ(rate.light, Light::kRed) << "limit 1 %";
}

}  // namespace
}  // namespace twocone::compare
