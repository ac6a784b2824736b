// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/summary/bounds.h"

#include <cmath>

#include <gtest/gtest.h>

#include "apps/runlog/summary/summary.h"
#include "tests/support/lab_robot.h"

namespace twocone::runlog {
namespace {

/// Returns a run of the lab's rig at three poses among three landmarks.
RunData run_of_three() {
  RunData run;
  run.robot = testing_support::lab_robot();
  run.map.landmarks = {{"red", {1, 0, 0}, -2.45, -0.35, 0.15, 0.9},
                       {"blue", {0, 0, 1}, 1.50, 1.95, 0.15, 0.9},
                       {"cyan", {0, 1, 1}, 2.45, 0.30, 0.15, 0.9}};
  for (int i = 0; i < 3; ++i) {
    FrameRow& frame = run.frames.emplace_back();
    frame.frame = std::uint64_t(10 + i);
    frame.t_s = 0.1 * i;
    run.truth.push_back({frame.t_s, 0.13 * i, -0.21, 0.7 * i});
    run.odometry.push_back(run.truth.back());
  }
  return run;
}

SightingRow sighting(std::uint64_t frame, const char* landmark, const char* view, double edge_noise_px) {
  SightingRow row;
  row.frame = frame;
  row.landmark = landmark;
  row.view = view;
  row.edge_noise_px = edge_noise_px;
  return row;
}

void add_all(RunData& run, std::uint64_t frame, double edge_noise_px) {
  for (const config::Landmark& landmark : run.map.landmarks) {
    for (const char* view : {"lower", "upper"}) {
      run.sightings.push_back(sighting(frame, landmark.name.c_str(), view, edge_noise_px));
    }
  }
}

TEST(Bounds, NoSightingsNoBound) { EXPECT_TRUE(bounds(run_of_three()).empty()); }

// A bound is proportional to the noise. The formulas are linear in it, so this is exact to rounding.
TEST(Bounds, GrowWithTheNoiseAndTakeAFramesOwn) {
  RunData run = run_of_three();
  add_all(run, 10, 0.1);
  add_all(run, 11, 0.1);
  add_all(run, 12, 0.3);
  const auto first = bounds(run);
  ASSERT_EQ(first.size(), 3U);
  for (SightingRow& row : run.sightings) row.edge_noise_px = 0.1;
  const auto second = bounds(run);
  constexpr double kRounding = 1e-9;
  for (std::size_t i = 0; i < 3; ++i) {
    const double factor = i == 2 ? 3 : 1;
    ASSERT_TRUE(first[i].covariance && second[i].covariance) << "frame " << first[i].frame;
    EXPECT_NEAR((*first[i].covariance)(0, 0) / (*second[i].covariance)(0, 0), factor * factor, kRounding * factor);
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_TRUE(first[i].landmarks[k] && second[i].landmarks[k]) << run.map.landmarks[k].name;
      EXPECT_NEAR(first[i].landmarks[k]->range_m / second[i].landmarks[k]->range_m, factor, kRounding * factor);
    }
    // At 0.1 px and 2 to 3 m, a range is known to a few millimetres and not to a micrometre.
    EXPECT_GT(second[i].landmarks[0]->range_m, 1e-5) << "m";
    EXPECT_LT(second[i].landmarks[0]->range_m, 1e-2) << "m";
  }
}

TEST(Bounds, AFrameWithoutItsOwnNoiseTakesTheMedian) {
  RunData run = run_of_three();
  add_all(run, 10, 0.05);
  add_all(run, 11, 0.25);
  add_all(run, 12, 0.1);
  const auto own = bounds(run);
  std::erase_if(run.sightings, [](const SightingRow& row) { return row.frame == 12; });
  run.sightings.push_back(sighting(99, "red", "lower", 0.1));  // the third value for the median
  run.sightings.push_back(sighting(99, "red", "upper", 0.1));
  const auto usual = bounds(run);
  ASSERT_TRUE(own[2].landmarks[0] && usual[2].landmarks[0]);
  EXPECT_DOUBLE_EQ(own[2].landmarks[0]->range_m, usual[2].landmarks[0]->range_m);
}

TEST(Bounds, OneViewGivesLessInformationThanTwo) {
  RunData run = run_of_three();
  add_all(run, 10, 0.1);
  const auto both = bounds(run);
  std::erase_if(run.sightings, [](const SightingRow& row) {
    return row.landmark == "blue" || (row.landmark == "red" && row.view == "upper");
  });
  const auto fewer = bounds(run);
  ASSERT_TRUE(both[0].landmarks[0] && fewer[0].landmarks[0]);
  EXPECT_GT(fewer[0].landmarks[0]->range_m, both[0].landmarks[0]->range_m);
  EXPECT_FALSE(fewer[0].landmarks[1]) << "never sighted";
  ASSERT_TRUE(both[0].covariance && fewer[0].covariance);
  EXPECT_GT(fewer[0].covariance->trace(), both[0].covariance->trace());
}

TEST(Bounds, WithoutTruthTheEstimatesPoseIsTaken) {
  RunData run = run_of_three();
  add_all(run, 10, 0.1);
  const auto expected = bounds(run);
  run.estimate = {run.truth[1]};
  run.truth.clear();
  const auto found = bounds(run);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_FALSE(found[0].covariance) << "a frame without a pose";
  ASSERT_TRUE(found[1].covariance);
  EXPECT_EQ(*found[1].covariance, *expected[1].covariance);
}

// The comparison uses the frames that have both errors and bounds.
TEST(Bounds, AreInTheSummaryBesideTheErrors) {
  RunData run = run_of_three();
  add_all(run, 10, 0.1);
  const auto all = bounds(run);
  for (std::size_t i = 0; i < 2; ++i) {  // the third frame has no answer
    RangeRow& range = run.ranges.emplace_back();
    range.frame = run.frames[i].frame;
    range.landmark = "blue";
    range.verdict = "ok";
    range.true_range_m = 2;
    range.range_m = 2 + 3 * all[i].landmarks[1]->range_m;
    FixRow& fix = run.fixes.emplace_back();
    fix.frame = run.frames[i].frame;
    fix.verdict = "ok";
    fix.x_m = fix.y_m = 0;
    fix.error_m = 2 * std::sqrt((*all[i].covariance)(0, 0) + (*all[i].covariance)(1, 1));
    fix.heading_rad = run.truth[i].heading_rad + 0.5 * std::sqrt((*all[i].covariance)(2, 2));
  }
  const Summary s = summarise(run);
  ASSERT_TRUE(s.landmarks[1].range_bound_m && s.position_bound_m && s.heading_bound_rad);
  EXPECT_EQ(s.landmarks[1].range_bound_m->count, 2);
  constexpr double kRounding = 1e-9;  // of sums and differences near 2 m against millimetres
  EXPECT_NEAR(*s.landmarks[1].range_bound_m->ratio(), 3, kRounding);
  EXPECT_NEAR(*s.position_bound_m->ratio(), 2, kRounding);
  EXPECT_NEAR(*s.heading_bound_rad->ratio(), 0.5, kRounding);
  EXPECT_FALSE(s.landmarks[0].range_bound_m);
}

}  // namespace
}  // namespace twocone::runlog
