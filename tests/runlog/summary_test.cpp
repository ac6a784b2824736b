// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/summary/summary.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace twocone::runlog {
namespace {

TEST(Statistics, AreThoseOfTheListAndHideNothing) {
  const auto s = statistics({0.03, 0.01, 0.02, 0.5});
  ASSERT_TRUE(s);
  EXPECT_EQ(s->count, 4);
  EXPECT_DOUBLE_EQ(s->mean, 0.14);
  EXPECT_DOUBLE_EQ(s->rmse, std::sqrt((0.0009 + 0.0001 + 0.0004 + 0.25) / 4));
  EXPECT_EQ(s->p95, 0.5);
  EXPECT_EQ(s->max, 0.5);
  EXPECT_FALSE(statistics({}));
}

TEST(Statistics, TheNinetyFifthPercentileIsTheNearestRank) {
  std::vector<double> errors;
  for (int i = 1; i <= 100; ++i) errors.push_back(i);
  EXPECT_EQ(statistics(errors)->p95, 95);
  errors.push_back(101);
  EXPECT_EQ(statistics(errors)->p95, 96);
  EXPECT_EQ(statistics({7})->p95, 7);
}

RunData small_run() {
  RunData run;
  run.method = "paper";
  config::Landmark red;
  red.name = "red";
  run.map.landmarks = {red};
  for (int i = 0; i < 4; ++i) {
    FrameRow frame;
    frame.frame = std::uint64_t(i);
    frame.t_s = i * 0.5;
    run.frames.push_back(frame);
    run.truth.push_back({frame.t_s, 0.3 * i, 0.4 * i, 0.1 * i});
    run.odometry.push_back({frame.t_s, 0.3 * i, 0.4 * i + 0.01 * i, 0});
    RangeRow range;
    range.frame = frame.frame;
    range.landmark = "red";
    range.verdict = i == 2 ? "truncated" : "ok";
    range.true_range_m = 2;
    if (i != 2) range.range_m = 2 + 0.01 * (i + 1) * (i % 2 == 0 ? 1 : -1);
    run.ranges.push_back(range);
  }
  const auto fix = [](std::uint64_t frame, const char* verdict, std::optional<double> error_m) {
    FixRow row;
    row.frame = frame;
    row.verdict = verdict;
    row.error_m = error_m;
    if (error_m) row.x_m = 1;
    return row;
  };
  run.fixes = {fix(0, "ok", 0.02), fix(1, "ambiguous", 0.01), fix(1, "ambiguous", 1.5), fix(2, "too_few", {}),
               fix(3, "gap", 0.04)};
  return run;
}

// Catches a position behind the wall that counts as a fix, and as an error of a fix.
TEST(Summary, WhatIsOutOfBoundsIsNoFix) {
  RunData run = small_run();
  FixRow& row = run.fixes[0];
  row.verdict = "out_of_bounds";
  row.true_x_m = row.true_y_m = row.y_m = 0;
  row.var_x_m2 = row.var_y_m2 = 1e-6;
  row.cov_xy_m2 = 0;
  const Summary s = summarise(run);
  EXPECT_EQ(s.frames_with_fix, 2);
  EXPECT_EQ(s.fix_error->count, 2);
  EXPECT_EQ(s.fix_verdicts.at("out_of_bounds"), 1);
  EXPECT_FALSE(s.in_ellipse_95);
}

TEST(Summary, CountsWhatTheTrackMadeOfTheFixes) {
  RunData run = small_run();
  EXPECT_TRUE(summarise(run).track_uses.empty()) << "an older run has no such table";
  for (const auto& [state, use] : {std::pair{"lost", "no_fix"},
                                   {"tracking", "started"},
                                   {"tracking", "taken"},
                                   {"lost", "unexpected"},
                                   {"lost", "unexpected"}}) {
    run.track.push_back({.state = state, .use = use});
  }
  const Summary s = summarise(run);
  EXPECT_EQ(s.track_states.at("lost"), 3);
  EXPECT_EQ(s.track_states.at("tracking"), 2);
  EXPECT_EQ(s.track_uses.at("unexpected"), 2);
  EXPECT_NE(to_json(s, run.info).find("\"unexpected\": 2"), std::string::npos);
}

TEST(Summary, CountsFramesAndKeepsTheWorseOfTwoAnswers) {
  const Summary s = summarise(small_run());
  EXPECT_EQ(s.frames, 4);
  EXPECT_DOUBLE_EQ(s.duration_s, 1.5);
  ASSERT_EQ(s.landmarks.size(), 1U);
  EXPECT_EQ(s.landmarks[0].verdicts.at("ok"), 3);
  EXPECT_EQ(s.landmarks[0].verdicts.at("truncated"), 1);
  EXPECT_EQ(s.landmarks[0].error->count, 3);
  EXPECT_NEAR(s.landmarks[0].error->mean, (0.01 + 0.02 + 0.04) / 3, 1e-15);
  EXPECT_EQ(s.frames_with_fix, 3);
  EXPECT_EQ(s.fix_verdicts.at("ambiguous"), 1);
  EXPECT_EQ(s.fix_error->max, 1.5);
  EXPECT_EQ(s.fix_error->count, 3);
  EXPECT_NEAR(*s.travelled_m, 1.5, 1e-15);
  EXPECT_EQ(*s.headings_covered_deg, 20);  // 0, 5.7 | 11.5, 17.2 degrees: two bins of ten
  EXPECT_NEAR(s.odometry_error->max, 0.03, 1e-15);
}

TEST(Summary, HeadingsAreComparedRoundTheCircle) {
  RunData run = small_run();
  run.truth[3].heading_rad = 3.1;
  run.fixes[4].heading_rad = -3.1;  // 2 pi - 6.2 = 0.0832 away
  run.fixes[1].heading_rad = 0.1;
  run.fixes[2].heading_rad = 0.5;  // the worse of two answers in frame 1, where 0.1 is true: 0.4
  run.estimate = {{0.5, 0.3, 0.4, 0.1}, {1.5, 0.9, 1.25, 3.1}};
  const Summary s = summarise(run);
  ASSERT_TRUE(s.heading_error);
  EXPECT_EQ(s.heading_error->count, 2);
  EXPECT_NEAR(s.heading_error->max, 0.4, 1e-15);
  EXPECT_NEAR(s.heading_error->mean, (0.4 + 2 * std::numbers::pi - 6.2) / 2, 1e-15);
  ASSERT_TRUE(s.estimate_error);
  EXPECT_EQ(s.estimate_error->count, 2);
  EXPECT_NEAR(s.estimate_error->max, 0.05, 1e-15);
  EXPECT_NEAR(s.estimate_heading_error->max, 0, 1e-15);
}

// Calculated by hand: sigmas 0.01 and 0.02 without correlation contain (0.02, 0.02), 4 + 1 < 5.99, but not (0.02,
// 0.03), 4 + 2.25. A correlation of 0.9 excludes the former: (4 + 1 - 3.6) / 0.19 = 7.4.
TEST(Summary, CountsEllipsesThatHoldTheTruth) {
  RunData run = small_run();
  run.fixes.clear();
  const auto add = [&](std::uint64_t frame, const char* verdict, double dx_m, double dy_m, double covariance_m2) {
    FixRow& row = run.fixes.emplace_back();
    row.frame = frame;
    row.verdict = verdict;
    row.x_m = 1 + dx_m;
    row.y_m = 2 + dy_m;
    row.true_x_m = 1;
    row.true_y_m = 2;
    row.var_x_m2 = 1e-4;
    row.cov_xy_m2 = covariance_m2;
    row.var_y_m2 = 4e-4;
  };
  add(0, "ok", 0.02, 0.02, 0);
  add(1, "ok", 0.02, 0.03, 0);
  add(2, "ok", 0.02, 0.02, 0.9 * 2e-4);
  add(3, "ambiguous", 1.0, 0.0, 0);
  add(3, "ambiguous", 0.0, 0.001, 0);
  Summary s = summarise(run);
  ASSERT_TRUE(s.in_ellipse_95);
  EXPECT_EQ(s.in_ellipse_95->count, 4);
  EXPECT_EQ(s.in_ellipse_95->held, 2);
  run.fixes[0].verdict = "weak";
  run.fixes[1].var_x_m2 = 0;  // not positive definite: contains nothing, and is not left out
  s = summarise(run);
  EXPECT_EQ(s.in_ellipse_95->count, 3);
  EXPECT_EQ(s.in_ellipse_95->held, 1);
}

TEST(Summary, CountsSigmasThatHoldAndOutliersOncePerFrame) {
  RunData run = small_run();
  for (RangeRow& row : run.ranges) {
    if (row.range_m) row.sigma_range_m = 0.0151;  // errors 0.01, 0.02, 0.04; 1.96 sigma is 0.0296
  }
  run.fixes[1].outliers = run.fixes[2].outliers = {"red"};  // two answers of one frame
  run.fixes[4].outliers = {"blue", "red"};
  const Summary s = summarise(run);
  ASSERT_TRUE(s.landmarks[0].within_95);
  EXPECT_EQ(s.landmarks[0].within_95->held, 2);
  EXPECT_EQ(s.landmarks[0].within_95->count, 3);
  EXPECT_EQ(s.landmarks[0].outliers, 2);
  EXPECT_EQ(s.landmarks[0].frames_with_range, 3);
  EXPECT_FALSE(s.landmarks[0].range_bound_m) << "no sightings, no bound";
  const auto json = nlohmann::json::parse(to_json(s, {}));
  EXPECT_EQ(json.at("landmarks")[0].at("range_within_1.96_sigma").at("held"), 2);
  EXPECT_EQ(json.at("landmarks")[0].at("outliers"), 2);
  EXPECT_TRUE(json.at("fix").at("position_bound").is_null());
}

TEST(Summary, WithoutTruthThereAreNoErrors) {
  RunData run = small_run();
  run.truth.clear();
  for (auto& row : run.ranges) row.true_range_m.reset();
  for (auto& row : run.fixes) row.error_m.reset();
  const Summary s = summarise(run);
  EXPECT_FALSE(s.landmarks[0].error);
  EXPECT_FALSE(s.fix_error);
  EXPECT_FALSE(s.odometry_error);
  EXPECT_FALSE(s.travelled_m);
  EXPECT_EQ(s.frames_with_fix, 3);
  const auto json = nlohmann::json::parse(to_json(s, {}));
  EXPECT_TRUE(json.at("fix").at("position_error").is_null());
  EXPECT_EQ(json.at("fix").at("verdicts").at("gap"), 1);
}

}  // namespace
}  // namespace twocone::runlog
