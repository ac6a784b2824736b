// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/compare/findings.h"
#include "apps/config/robot_file.h"
#include "tests/compare/made_up_side.h"
#include "tests/support/temporary_folder.h"
#include "vision/image_quality.h"

namespace twocone::compare {
namespace {

using testing::HasSubstr;

constexpr double kFourDigits = 5e-4;  // relative: numbers are written with four digits

class Correct : public testing::Test {
 protected:
  Correct() {
    Comparison& c = outcome_.comparison;
    c.simulated = "runs/simulated", c.real = "runs/real";
    c.simulated_robot = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
    c.real_robot = config::read_robot(TWOCONE_SOURCE_DIR "/robots/usb_camera.yaml");
    outcome_.calibration = made_up_side("memory", made_up_result()).calibration;
    calibrate::Report& report = *outcome_.calibration;
    report.rig = c.real_robot.rig;
    report.rig.lower.centre_px = {322.5, 238.25};
    report.rig.upper.tilt_rad = {0.01, -0.02};
    report.rig.mirror_separation_m = 0.3015;
    report.drive = c.real_robot.drive;
    report.drive.wheel_radius_m = 0.0512;
    report.drive.wheel_separation_m = 0.297;
  }
  void add(Cause cause, std::optional<vision::Side> view, std::vector<Component> components,
           SourceVerdict verdict = SourceVerdict::kDiffers) {
    outcome_.comparison.sources.push_back(
        {.cause = cause, .view = view, .verdict = verdict, .components = std::move(components)});
  }
  [[nodiscard]] config::Robot read(const std::string& text) const {
    return config::read_robot(folder_.write("new.yaml", text));
  }
  [[nodiscard]] config::Robot like() const { return read(like_the_real(outcome_, folder_.path() / "new.yaml")); }

  testing_support::TemporaryFolder folder_;
  Outcome outcome_;
};

TEST_F(Correct, TheRealRobotReadsBackWithTheCalibrationsNumbers) {
  add(Cause::kCentre, vision::Side::kLower, {{"lower.centre_px.column", "px", 319.5, 322.5, 0.1}});
  const std::string text = corrected_robot(outcome_, folder_.path() / "new.yaml");
  EXPECT_THAT(text, HasSubstr("runs/real"));
  EXPECT_THAT(text, HasSubstr("Found to differ: lower centre."));
  const config::Robot robot = read(text);
  const calibrate::Report& report = *outcome_.calibration;
  EXPECT_EQ(robot.rig.lower, report.rig.lower);
  EXPECT_EQ(robot.rig.upper, report.rig.upper);
  EXPECT_EQ(robot.rig.mirror_separation_m, 0.3015);
  EXPECT_EQ(robot.drive.wheel_radius_m, 0.0512);
  EXPECT_EQ(robot.drive.wheel_separation_m, 0.297);
  EXPECT_EQ(robot.rig.calibration.filename(), "new.calibration.json");
  EXPECT_EQ(robot.lower.driver, "v4l2_camera") << "everything else is unchanged";
}

TEST_F(Correct, WithoutADifferenceTheSimulationIsUnchanged) {
  add(Cause::kExposureAndColour, vision::Side::kLower, {}, SourceVerdict::kCannotTell);
  add(Cause::kFramesLost, vision::Side::kLower, {{"lost", "%", 0, 5, 1}}, SourceVerdict::kAgrees);
  const std::string text = like_the_real(outcome_, folder_.path() / "new.yaml");
  EXPECT_THAT(text, HasSubstr("No difference was found."));
  config::Robot robot = read(text);
  robot.file = outcome_.comparison.simulated_robot.file;
  EXPECT_EQ(robot, outcome_.comparison.simulated_robot);
}

TEST_F(Correct, ADifferenceBecomesAnEffect) {
  add(Cause::kExposureAndColour, vision::Side::kLower, gains(1.1, 1.2, 1.3, 0.3));
  add(Cause::kExposureAndColour, vision::Side::kUpper, gains(0.8, 0.8, 0.8, 0.03));
  add(Cause::kFramesLost, vision::Side::kUpper, {{"lost", "%", 0, 5, 1}});
  add(Cause::kLatency, std::nullopt, {{"latency_s", "ms", 0, 40, 1}});
  add(Cause::kSkew, std::nullopt, {{"upper.skew_s", "ms", 0, -10, 1}});
  add(Cause::kRollingShutter, vision::Side::kLower, {{"lower.readout_s", "ms", 0, 25, 1}});
  add(Cause::kSharpness, vision::Side::kUpper, {{"blur", "px", 0.4, 0.9, 0.05}});
  add(Cause::kFrameRate, std::nullopt, {{"rate_hz", "Hz", 15, 12.5, 0.1}});
  add(Cause::kSlip, std::nullopt, {{"slip", "%", 1, 2.5, 0.1}});
  const config::Robot robot = like();
  const auto &lower = robot.lower.effects, &upper = robot.upper.effects;
  EXPECT_NEAR(lower.gain, std::cbrt(1.1 * 1.2 * 1.3), 1.2 * kFourDigits) << "the colours' mean";
  EXPECT_NEAR(upper.gain, 0.8, 0.8 * kFourDigits);
  EXPECT_EQ(lower.vignetting, 0.3);
  EXPECT_EQ(upper.vignetting, 0) << "within three sigmas of 0";
  EXPECT_EQ(lower.drop_probability, 0);
  EXPECT_EQ(upper.drop_probability, 0.05);
  EXPECT_EQ(lower.stamp_late_s, 0.04);
  EXPECT_EQ(upper.stamp_late_s, 0.05) << "exposed 10 ms before what its stamp says against the lower one's";
  EXPECT_EQ(lower.readout_s, 0.025);
  EXPECT_EQ(upper.readout_s, 0);
  EXPECT_EQ(lower.defocus_px, 0);
  EXPECT_NEAR(upper.defocus_px, vision::defocus_radius_px(0.4, 0.9), kFourDigits * upper.defocus_px);
  EXPECT_GT(upper.defocus_px, 1) << "px";
  EXPECT_EQ(robot.lower.settings.rate_hz, 12.5);
  EXPECT_EQ(robot.upper.settings.rate_hz, 12.5);
  EXPECT_EQ(robot.effects.slip, 0.025);
  EXPECT_EQ(robot.rig, outcome_.comparison.simulated_robot.rig) << "that of the scene";
}

TEST_F(Correct, TheNoiseIsThatOfTheRealImages) {
  constexpr double kFullWell = 5000, kRead = 12;  // electrons
  add(Cause::kNoise, vision::Side::kUpper, {{"noise", "grey", 0, 3, 0.1}});
  for (auto& block : outcome_.images.views[1].real_noise.blocks) {
    for (std::size_t bin = 4; bin < 13; ++bin) {
      const double light = 0.05 * double(bin), tiles = 100;
      const double variance = light / kFullWell + std::pow(kRead / kFullWell, 2);
      block[bin] = {tiles, tiles * light, tiles * variance};
    }
  }
  outcome_.images.views[1].real_noise.images = 16;
  const config::Robot robot = like();
  EXPECT_NEAR(robot.upper.effects.full_well_electrons, kFullWell, 0.001 * kFullWell);
  EXPECT_NEAR(robot.upper.effects.read_noise_electrons, kRead, 0.01 * kRead);
  EXPECT_EQ(robot.lower.effects, outcome_.comparison.simulated_robot.lower.effects);
}

TEST_F(Correct, AVignetteThatIsAlreadySimulatedStays) {
  config::Robot with = outcome_.comparison.simulated_robot;
  with.lower.effects.vignetting = 0.3;
  const std::string text = config::robot_text(with.file, folder_.path() / "with.yaml", with, {});
  outcome_.comparison.simulated_robot = config::read_robot(folder_.write("with.yaml", text));
  ASSERT_EQ(outcome_.comparison.simulated_robot.lower.effects.vignetting, 0.3);
  add(Cause::kExposureAndColour, vision::Side::kLower, gains(1.2, 1.2, 1.2, 0.01));
  EXPECT_EQ(like().lower.effects.vignetting, 0.3) << "both runs have it";
}

TEST_F(Correct, WheelsAreThoseOfTheCalibration) {
  outcome_.comparison.simulated_robot.effects.wheel_radius_m = 0.049;
  add(Cause::kWheelRadius, std::nullopt, {{"wheel_radius_m", "mm", 50, 51.2, 0.1}});
  const config::Robot robot = like();
  EXPECT_EQ(robot.drive.wheel_radius_m, 0.0512);
  EXPECT_EQ(robot.drive.wheel_separation_m, 0.297);
  EXPECT_FALSE(robot.effects.wheel_radius_m) << "belief and truth are equal";
}

TEST(Advise, EverySourceThatDiffersGetsASentence) {
  const Side a = made_up_side("sim_povray", made_up_result()), b = made_up_side("memory", made_up_result());
  double level = 0;
  std::vector<Source> sources = find_sources({a, b, timing_of(a.run), timing_of(b.run)}, {}, 1e-3, level);
  sources.push_back({.cause = Cause::kLandmark, .landmark = "red"});
  for (Source& source : sources) {
    source.verdict = SourceVerdict::kAgrees;
    EXPECT_TRUE(source.advice().empty());
    source.verdict = SourceVerdict::kDiffers;
    EXPECT_FALSE(source.advice().empty()) << source.name();
  }
}

}  // namespace
}  // namespace twocone::compare
