// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/compare/made_up_side.h"

namespace twocone::compare {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using vision::CalibrationResult;

constexpr double kSigma = 1e-3;  // of made_up_result(), SI

/// Returns the sources of a simulated and a real run with these calibrations and nothing else.
std::vector<Source> sources_of(const CalibrationResult& simulated, const CalibrationResult& real, double false_alarm,
                               double& level) {
  const Side a = made_up_side("sim_povray", simulated), b = made_up_side("memory", real);
  return find_sources({a, b, timing_of(a.run), timing_of(b.run)}, {}, false_alarm, level);
}
std::vector<Source> sources_of(const CalibrationResult& simulated, const CalibrationResult& real) {
  double level = 0;
  return sources_of(simulated, real, 1e-3, level);
}

TEST(Sources, WithoutADifferenceNoneDiffers) {
  const auto sources = sources_of(made_up_result(), made_up_result());
  EXPECT_THAT(names_of(sources, SourceVerdict::kDiffers), IsEmpty());
  EXPECT_THAT(names_of(sources, SourceVerdict::kAgrees), Contains("upper tilt"));
}

TEST(Sources, APlantedDifferenceIsNamedAlone) {
  CalibrationResult real = made_up_result();
  parameter(real, "lower.centre_px.column").after += 1;
  const auto sources = sources_of(made_up_result(), real);
  EXPECT_THAT(names_of(sources, SourceVerdict::kDiffers), ElementsAre("lower centre"));
  const Source centre = source_of(sources, "lower centre");
  ASSERT_EQ(centre.components.size(), 2U);
  EXPECT_EQ(centre.components[0].name, "lower.centre_px.column");
  EXPECT_EQ(centre.components[0].unit, "px");
  EXPECT_NEAR(centre.components[0].difference(), 1, 1e-12);
  EXPECT_EQ(centre.components[1].difference(), 0);
}

TEST(Sources, TheTestIsThatOfBothCovariancesAndTheModel) {
  CalibrationResult real = made_up_result();
  parameter(real, "lower.centre_px.row").after += 0.1;
  const Source centre = source_of(sources_of(made_up_result(), real), "lower centre");
  const double variance = 2 * kSigma * kSigma + 0.03 * 0.03;  // both runs' and ModelSigmas::centre_px
  EXPECT_NEAR(centre.components[1].sigma, std::sqrt(variance), 1e-12);
  EXPECT_NEAR(centre.chi_squared, 0.01 / variance, 1e-9);
  // With two degrees of freedom the tail is exp(-chi^2 / 2): 0.0039.
  EXPECT_NEAR(centre.p_value, std::exp(-0.005 / variance), 1e-9);
  EXPECT_EQ(centre.verdict, SourceVerdict::kAgrees) << "one in 256 is less significant than the level requires";
}

TEST(Sources, NumbersAreShownInTheirUnits) {
  CalibrationResult real = made_up_result(1e-6);
  parameter(real, "upper.tilt_rad.y").after += 0.01;
  parameter(real, "wheel_radius_m").after += 0.001;
  const auto sources = sources_of(made_up_result(1e-6), real);
  EXPECT_THAT(names_of(sources, SourceVerdict::kDiffers), ElementsAre("upper tilt", "wheel radius"));
  EXPECT_NEAR(source_of(sources, "upper tilt").components[1].difference(), 0.01 * 180 / M_PI, 1e-9);
  EXPECT_EQ(source_of(sources, "upper tilt").components[1].unit, "deg");
  EXPECT_NEAR(source_of(sources, "wheel radius").components[0].difference(), 1, 1e-9);
  EXPECT_EQ(source_of(sources, "wheel radius").components[0].unit, "mm");
}

TEST(Sources, CorrelatedSourcesAreConfusable) {
  for (const double correlation : {0.99, 0.5}) {
    CalibrationResult real = made_up_result();
    const auto i = index_of(real, "lower.centre_px.column"), k = index_of(real, "lower.tilt_rad.y");
    real.covariance(i, k) = real.covariance(k, i) = -correlation * kSigma * kSigma;
    const auto sources = sources_of(made_up_result(), real);
    if (correlation > kConfusable) {
      EXPECT_THAT(source_of(sources, "lower centre").confusable, ElementsAre("lower tilt"));
      EXPECT_THAT(source_of(sources, "lower tilt").confusable, ElementsAre("lower centre"));
      EXPECT_THAT(source_of(sources, "upper centre").confusable, IsEmpty());
    } else {
      EXPECT_THAT(source_of(sources, "lower centre").confusable, IsEmpty());
    }
  }
}

TEST(Sources, NumbersOfOneSourceAreNotConfusableWithThemselves) {
  CalibrationResult real = made_up_result();
  const auto i = index_of(real, "upper.centre_px.column"), k = index_of(real, "upper.centre_px.row");
  real.covariance(i, k) = real.covariance(k, i) = 0.99 * kSigma * kSigma;
  EXPECT_THAT(source_of(sources_of(made_up_result(), real), "upper centre").confusable, IsEmpty());
}

TEST(Sources, WhatTheDriveDoesNotDetermineIsReported) {
  CalibrationResult simulated = made_up_result(), real = made_up_result();
  parameter(real, "lower.rim_radius_px").observed = false;
  parameter(real, "lower.rim_radius_px").after += 50;
  parameter(simulated, "latency_s").observed = parameter(real, "latency_s").observed = false;
  const auto sources = sources_of(simulated, real);
  const Source focal = source_of(sources, "lower focal length");
  EXPECT_EQ(focal.verdict, SourceVerdict::kCannotTell);
  EXPECT_EQ(focal.reason, "the drive does not determine lower.rim_radius_px (real run)");
  EXPECT_THAT(focal.components, IsEmpty());
  EXPECT_EQ(source_of(sources, "latency").reason, "the drive does not determine latency_s (both runs)");
}

TEST(Sources, NamesThePartOfASourceThatIsNotDetermined) {
  CalibrationResult real = made_up_result();
  parameter(real, "lower.tilt_rad.x").observed = false;
  parameter(real, "lower.tilt_rad.y").after += 1;
  const Source tilt = source_of(sources_of(made_up_result(), real), "lower tilt");
  EXPECT_EQ(tilt.verdict, SourceVerdict::kDiffers);
  ASSERT_EQ(tilt.components.size(), 1U);
  EXPECT_EQ(tilt.components[0].name, "lower.tilt_rad.y");
  EXPECT_THAT(tilt.reason, HasSubstr("lower.tilt_rad.x (real run)"));
}

TEST(Sources, WithoutACalibrationNoSourceOfTheRigIsDetermined) {
  Side a = made_up_side("sim_povray", made_up_result()), b = made_up_side("memory", made_up_result());
  b.calibration.reset();
  b.why_no_calibration = "too dark";
  double level = 0;
  const auto sources = find_sources({a, b, timing_of(a.run), timing_of(b.run)}, {}, 1e-3, level);
  EXPECT_EQ(source_of(sources, "mirrors' alignment").verdict, SourceVerdict::kCannotTell);
  EXPECT_EQ(source_of(sources, "mirrors' alignment").reason, "too dark");
  EXPECT_EQ(source_of(sources, "frame rate").verdict, SourceVerdict::kAgrees);
}

TEST(Sources, TheLevelIsSharedByThoseThatAreTested) {
  CalibrationResult real = made_up_result();
  parameter(real, "latency_s").observed = false;
  double level = 0;
  const auto sources = sources_of(made_up_result(), real, 0.02, level);
  const auto tested = double(sources.size() - names_of(sources, SourceVerdict::kCannotTell).size());
  EXPECT_GT(tested, 10);
  EXPECT_NEAR(level, 0.02 / tested, 1e-15);
}

TEST(Sources, LostFramesAreComparedWithTheSetLossOfTheSimulation) {
  Side a = made_up_side("sim_povray", made_up_result()), b = made_up_side("memory", made_up_result());
  a.run.robot.lower.effects.drop_probability = a.run.robot.upper.effects.drop_probability = 0.1;
  b.run.frames[5].lower_lost = 4;   // of 44: 9 %
  b.run.frames[5].upper_lost = 40;  // of 80: a half
  double level = 0;
  const auto sources = find_sources({a, b, timing_of(a.run), timing_of(b.run)}, {}, 1e-3, level);
  EXPECT_EQ(source_of(sources, "lower frames lost").verdict, SourceVerdict::kAgrees);
  EXPECT_EQ(source_of(sources, "upper frames lost").verdict, SourceVerdict::kDiffers);
  EXPECT_NEAR(source_of(sources, "upper frames lost").components[0].simulated, 10, 1e-9);
  EXPECT_NEAR(source_of(sources, "upper frames lost").components[0].real, 50, 1e-9);
}

/// Returns the tolerance that ModelSigmas gives a parameter of made_up_result().
double model_sigma(const std::string& name) {
  const ModelSigmas model;
  const auto has = [&name](const char* part) { return name.find(part) != std::string::npos; };
  if (has("rim_radius_px")) return model.rim_px;
  if (has("centre_px")) return model.centre_px;
  if (has("tilt_rad")) return model.tilt_rad;
  if (has("azimuth")) return model.azimuth_rad;
  if (has("apex_rad")) return model.apex_rad;
  if (has("axis_offset")) return model.offset_m;
  if (has("mirror_radius_m") || has("lens_to_tip_m") || has("mirror_separation_m") || has("lens_height_m")) {
    return model.length_m;
  }
  return 0;
}

TEST(Sources, FalseAlarmsAreAsFrequentAsRequested) {
  constexpr int kComparisons = 2000;
  constexpr double kFalseAlarm = 0.5;  // high enough to give some alarms to count
  CalibrationResult simulated = made_up_result(1e-4), real = simulated;
  // Correlated within one source, so that the joint test is needed.
  for (const std::string view : {"lower", "upper"}) {
    const auto i = index_of(real, view + ".centre_px.column"), k = index_of(real, view + ".centre_px.row");
    for (CalibrationResult* const result : {&simulated, &real}) {
      result->covariance(i, i) = result->covariance(k, k) = 0.01;
      result->covariance(i, k) = result->covariance(k, i) = 0.008;
    }
  }
  Eigen::MatrixXd covariance = simulated.covariance + real.covariance;
  for (std::size_t i = 0; i < real.parameters.size(); ++i) {
    covariance(Eigen::Index(i), Eigen::Index(i)) += std::pow(model_sigma(real.parameters[i].name), 2);
  }
  const Eigen::MatrixXd root = covariance.llt().matrixL();
  Side a = made_up_side("sim_povray", simulated), b = made_up_side("memory", real);
  const Timing timing_a = timing_of(a.run), timing_b = timing_of(b.run);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  int alarms = 0, comparisons_with = 0;
  double level = 0;
  std::size_t of_the_rig = 0;
  Eigen::VectorXd draw(root.rows());
  for (int n = 0; n < kComparisons; ++n) {
    for (double& value : draw) value = normal(random);
    const Eigen::VectorXd difference = root * draw;
    auto& parameters = b.calibration->result.parameters;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      parameters[i].after = simulated.parameters[i].after + difference[Eigen::Index(i)];
    }
    const auto sources = find_sources({a, b, timing_a, timing_b}, {}, kFalseAlarm, level);
    const auto names = names_of(sources, SourceVerdict::kDiffers);
    alarms += int(names.size());
    comparisons_with += names.empty() ? 0 : 1;
    if (n > 0) continue;
    // Only the sources whose numbers are drawn can alarm; the numbers of the others are equal.
    for (const Source& source : sources) of_the_rig += source.chi_squared > 0 ? 1 : 0;
  }
  ASSERT_GE(of_the_rig, 15U);
  // Both counts are binomial: independent tests at `level`, and comparisons of which 1 - (1 - level)^tests have any.
  // Five standard deviations: one in a million, and the seed is fixed.
  constexpr double kSigmas = 5;
  const double tests = kComparisons * double(of_the_rig);
  EXPECT_NEAR(alarms, tests * level, kSigmas * std::sqrt(tests * level));
  const double any = 1 - std::pow(1 - level, double(of_the_rig));
  EXPECT_LE(any, kFalseAlarm);
  EXPECT_NEAR(comparisons_with, kComparisons * any, kSigmas * std::sqrt(kComparisons * any * (1 - any)));
}

}  // namespace
}  // namespace twocone::compare
