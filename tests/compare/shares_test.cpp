// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <cmath>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "tests/compare/made_up_side.h"

namespace twocone::compare {
namespace {

constexpr double kShareRounding = 1e-9;

Source source(Cause cause, std::optional<vision::Side> view, SourceVerdict verdict,
              std::vector<Component> components = {}) {
  return {.cause = cause, .view = view, .verdict = verdict, .components = std::move(components)};
}

const Gap& gap(const std::vector<Gap>& gaps, Quantity of) {
  return element_of(gaps, to_string(of), [](const Gap& g) { return to_string(g.of); });
}

class Shares : public testing::Test {
 protected:
  std::vector<Gap> gaps(std::vector<Source>& sources) {
    return find_gaps({.simulated = simulated_, .real = real_, .is_rendered = is_rendered_}, held_out_, images_,
                     sources);
  }
  Side simulated_ = made_up_side("sim_povray", made_up_result()), real_ = made_up_side("memory", made_up_result());
  std::vector<HeldOutRange> held_out_;
  Images images_;
  bool is_rendered_ = false;
};

TEST_F(Shares, OfRangesAreProjectionsThatAddUp) {
  std::vector<Source> sources{source(Cause::kCentre, vision::Side::kLower, SourceVerdict::kDiffers),
                              source(Cause::kTilt, vision::Side::kLower, SourceVerdict::kAgrees),
                              source(Cause::kSkew, std::nullopt, SourceVerdict::kDiffers)};
  held_out_ = {{0.003, 0.001, 0.001, {0.004, 0, -0.002}}, {-0.004, 0.001, 0.001, {-0.003, 0, 0.001}}};
  const auto found = gaps(sources);
  const Gap& range = gap(found, Quantity::kRange);
  EXPECT_NEAR(range.before, std::sqrt((9 + 16) / 2.0), kShareRounding);
  EXPECT_NEAR(range.after, 1, kShareRounding);
  EXPECT_NEAR(*range.floor, 1, kShareRounding);
  // (3 4 + 4 3) / 25 and (-3 2 - 4 1) / 25
  ASSERT_EQ(sources[0].shares.size(), 1U);
  EXPECT_EQ(sources[0].shares[0].of, Quantity::kRange);
  EXPECT_NEAR(sources[0].shares[0].share, 24.0 / 25, kShareRounding);
  EXPECT_TRUE(sources[1].shares.empty());
  ASSERT_EQ(sources[2].shares.size(), 1U);
  EXPECT_NEAR(sources[2].shares[0].share, -10.0 / 25, kShareRounding) << "it hides a part of the other's effect";
  EXPECT_NEAR(*range.unexplained, -1.0 / 25, kShareRounding) << "(3 1 - 4 1) / 25";
  EXPECT_NEAR(*range.unexplained + *range.unnamed + sources[0].shares[0].share + sources[2].shares[0].share, 1,
              kShareRounding);
}

TEST_F(Shares, WithoutRangesThereIsNoGapOfRanges) {
  std::vector<Source> none;
  for (const Gap& g : gaps(none)) EXPECT_NE(g.of, Quantity::kRange);
}

TEST_F(Shares, OfOdometryGoToTheWheels) {
  // The robot went 4 % farther than with the believed wheels: they are 4 % larger.
  constexpr double kMore = 1.04;
  for (auto& pose : real_.reference) pose->x_m *= kMore;
  real_.calibration->drive.wheel_radius_m *= kMore;
  std::vector<Source> sources{source(Cause::kWheelRadius, std::nullopt, SourceVerdict::kDiffers),
                              source(Cause::kWheelSeparation, std::nullopt, SourceVerdict::kAgrees)};
  const auto found = gaps(sources);
  const Gap& odometry = gap(found, Quantity::kOdometry);
  EXPECT_NEAR(odometry.after, 0, 1e-6);
  EXPECT_NEAR(*odometry.floor, 0, 1e-6);
  // The reference has 40 steps of 52 mm; a stretch is at least a metre: 20 steps are 1.04 m, of which 40 mm are
  // missing.
  EXPECT_NEAR(odometry.before, 40, 1e-6);
  ASSERT_EQ(sources[0].shares.size(), 1U);
  EXPECT_NEAR(sources[0].shares[0].share, 1, kShareRounding);
  EXPECT_NEAR(*odometry.unexplained, 0, kShareRounding);
  EXPECT_NEAR(*odometry.unnamed, 0, kShareRounding);
}

TEST_F(Shares, WhatTheCalibrationPutsRightWithoutASourceIsNotUnexplained) {
  // As above, but the simulated robot has the same error: no source differs.
  constexpr double kMore = 1.04;
  for (auto& pose : real_.reference) pose->x_m *= kMore;
  real_.calibration->drive.wheel_radius_m *= kMore;
  std::vector<Source> sources{source(Cause::kWheelRadius, std::nullopt, SourceVerdict::kAgrees)};
  const auto found = gaps(sources);
  const Gap& odometry = gap(found, Quantity::kOdometry);
  EXPECT_NEAR(odometry.after, 0, 1e-6);
  EXPECT_NEAR(*odometry.unexplained, 0, kShareRounding);
  EXPECT_NEAR(*odometry.unnamed, 1, kShareRounding);
  EXPECT_TRUE(sources[0].shares.empty());
}

TEST_F(Shares, PlacesThatAreRenderedAgainHaveNoWheelsAndNoFloorOfOdometry) {
  is_rendered_ = true;
  for (auto& pose : real_.reference) pose->x_m *= 1.04;
  std::vector<Source> none;
  EXPECT_FALSE(gap(gaps(none), Quantity::kOdometry).floor.has_value());
}

TEST_F(Shares, OfBrightnessGoToTheGainThatWasFound) {
  const double log_gain = std::log(1.2);
  vision::Transfer transfer;
  for (const double off : {-0.01, 0.01}) {
    transfer.log_gain = {log_gain + off, log_gain + off, log_gain + off};
    images_.views[0].transfers.push_back(transfer);
  }
  std::vector<Source> sources{
      source(Cause::kExposureAndColour, vision::Side::kLower, SourceVerdict::kDiffers, gains(1.2, 1.2, 1.2, 0))};
  const auto found = gaps(sources);
  const Gap& brightness = gap(found, Quantity::kBrightness);
  EXPECT_NEAR(brightness.after, 1, kShareRounding) << "% of scatter";
  EXPECT_NEAR(brightness.before, 100 * std::hypot(log_gain, 0.01), kShareRounding);
  const double share = log_gain * log_gain / (log_gain * log_gain + 1e-4);
  ASSERT_EQ(sources[0].shares.size(), 1U);
  EXPECT_NEAR(sources[0].shares[0].share, share, kShareRounding);
  EXPECT_NEAR(*brightness.unexplained, 1 - share, kShareRounding);
}

TEST_F(Shares, OfNoiseGoToTheViewsThatDiffer) {
  std::vector<Source> sources{
      source(Cause::kNoise, vision::Side::kLower, SourceVerdict::kDiffers, {{"noise", "grey", 1, 4, 0.3}}),
      source(Cause::kNoise, vision::Side::kUpper, SourceVerdict::kAgrees, {{"noise", "grey", 1, 2, 0.4}}),
  };
  const auto found = gaps(sources);
  const Gap& noise = gap(found, Quantity::kNoise);
  EXPECT_NEAR(noise.before, std::sqrt((9 + 1) / 2.0), kShareRounding);
  EXPECT_NEAR(noise.after, std::sqrt((0.09 + 1) / 2), kShareRounding)
      << "one sigma of the view that was found to differ";
  EXPECT_NEAR(*noise.floor, std::sqrt((0.09 + 0.16) / 2), kShareRounding);
  EXPECT_NEAR(sources[0].shares.at(0).share, 0.9, kShareRounding);
  EXPECT_NEAR(*noise.unexplained, 0.1, kShareRounding);
}

TEST(OdometryBy, DrivesTheWheelsAnglesWithOtherSizes) {
  runlog::RunData run;
  run.frames.resize(3);
  run.frames[1].t_s = 0.1, run.frames[2].t_s = 0.2;
  run.odometry = {{0, 1, 2, 0}, {}, {}};
  // Two radians straight ahead, then a turn in place: the right wheel forward and the left one back by one.
  run.drive = {{0, {}, {}, 5, 5}, {0.1, {}, {}, 7, 7}, {0.2, {}, {}, 6, 8}};
  const auto poses = odometry_by(run, {0.1, 0.4});
  ASSERT_EQ(poses.size(), 3U);
  EXPECT_NEAR(poses[0].x_m, 1, kShareRounding) << "beginning at the run's first odometry pose";
  EXPECT_NEAR(poses[1].x_m, 1.2, kShareRounding);
  EXPECT_NEAR(poses[2].x_m, 1.2, kShareRounding);
  EXPECT_NEAR(poses[2].y_m, 2, kShareRounding);
  EXPECT_NEAR(poses[2].heading_rad, 0.1 * 2 / 0.4, kShareRounding);
  EXPECT_EQ(poses[2].t_s, 0.2);
  run.drive.clear();
  EXPECT_TRUE(odometry_by(run, {0.1, 0.4}).empty()) << "the wheels were not recorded";
}

}  // namespace
}  // namespace twocone::compare
