// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_data.h"
#include "tests/compare/synthetic_run.h"
#include "tests/support/error_of.h"

namespace twocone::compare {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing_support::TemporaryFolder;

/// Runs that several tests read. A test that damages a run makes or copies its own.
class Compare : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    simulated_ = make_run(*folder_, "simulated", {});
  }
  static void TearDownTestSuite() { delete folder_; }

  void SetUp() override {
    if (!vision::can_calibrate()) GTEST_SKIP() << "needs Ceres, which this build does not have";
  }

  static Settings settings_for(const std::filesystem::path& real, const std::string& work) {
    Settings settings;
    settings.simulated = simulated_;
    settings.real = real;
    settings.work = folder_->path() / work;
    settings.fit_frames = kFitFrames;
    return settings;
  }

  static std::vector<std::string> differing(const Comparison& comparison) {
    std::vector<std::string> names;
    for (const Source* const source : comparison.sources_with(SourceVerdict::kDiffers)) names.push_back(source->name());
    return names;
  }

  static const Gap* gap_of(const Comparison& comparison, Quantity of) {
    const auto at = std::ranges::find(comparison.gaps, of, &Gap::of);
    return at == comparison.gaps.end() ? nullptr : &*at;
  }

  /// Copies the simulated run, to be damaged.
  static std::filesystem::path copy_of(const std::string& name) {
    std::filesystem::copy(simulated_, folder_->path() / name, std::filesystem::copy_options::recursive);
    return folder_->path() / name;
  }

  static std::string error_with(const std::filesystem::path& run) {
    Settings settings = settings_for(simulated_, "never");
    settings.simulated = run;
    try {
      const auto outcome = compare(settings);
      return outcome ? "an outcome" : outcome.error().message;
    } catch (const config::FileError& error) {
      return error.what();
    }
  }

  static constexpr std::size_t kFrames = 12;  // of SyntheticDrive
  static constexpr int kFitFrames = 6;
  static inline TemporaryFolder* folder_ = nullptr;
  static inline std::filesystem::path simulated_;
};

TEST_F(Compare, NothingPlantedNothingFound) {
  const auto real = make_run(*folder_, "same", {.driver = "memory", .seed = 2});
  Settings settings = settings_for(real, "same_work");
  std::vector<double> reported;
  settings.progress = [&reported](double done) { reported.push_back(done); };
  const auto outcome = compare(settings);
  ASSERT_TRUE(outcome) << outcome.error().message;
  const Comparison& c = outcome->comparison;
  EXPECT_THAT(differing(c), testing::IsEmpty());
  EXPECT_TRUE(c.is_within_limits()) << table(c);
  EXPECT_THAT(c.notes, testing::IsEmpty());
  EXPECT_EQ(c.matched_by_time, kFrames);
  EXPECT_EQ(c.matched_by_pose, kFrames);
  EXPECT_EQ(c.reference, "truth");
  ASSERT_FALSE(c.exhibits.empty());
  for (const Exhibit& exhibit : c.exhibits) {
    EXPECT_TRUE(std::filesystem::exists(exhibit.real_images[1])) << exhibit.real_images[1];
    EXPECT_EQ(exhibit.simulated.x_m, exhibit.real.x_m);
    EXPECT_EQ(exhibit.simulated.y_m, exhibit.real.y_m);
  }
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_EQ(reported.back(), 1);
}

TEST_F(Compare, AShiftedCentreIsNamedAndCorrected) {
  constexpr double kShift_px = 0.3;  // with more, both views contradict each other: no ranges
  const auto real =
      make_run(*folder_, "shifted", {.driver = "memory", .lower_centre_off_px = {kShift_px, 0}, .seed = 3});
  const auto outcome = compare(settings_for(real, "shifted_work"));
  ASSERT_TRUE(outcome) << outcome.error().message;
  const Comparison& c = outcome->comparison;
  ASSERT_THAT(differing(c), testing::ElementsAre("lower centre"));
  const auto centre =
      std::find_if(c.sources.begin(), c.sources.end(), [](const Source& s) { return s.name() == "lower centre"; });
  constexpr double kSigmas = 4;
  EXPECT_NEAR(centre->components[0].difference(), kShift_px, kSigmas * centre->components[0].sigma);
  EXPECT_NEAR(centre->components[1].difference(), 0, kSigmas * centre->components[1].sigma);
  EXPECT_LT(centre->components[0].sigma, 0.1) << "px";

  const Gap* const range = gap_of(c, Quantity::kRange);
  ASSERT_NE(range, nullptr);
  EXPECT_GT(range->before, 2) << "mm, or there is nothing to correct";
  EXPECT_LT(range->after, 0.3 * range->before);
  ASSERT_EQ(centre->shares.size(), 1U);
  EXPECT_EQ(centre->shares[0].of, Quantity::kRange);
  EXPECT_NEAR(centre->shares[0].share + *range->unexplained + *range->unnamed, 1, 1e-9);
  EXPECT_NEAR(*range->unnamed, 0, 0.1) << "changes of the calibration within its sigmas";
  EXPECT_GT(centre->shares[0].share, 0.5)
      << "the remainder is noise, and frames where the old numbers alone give no range";
  const config::Robot corrected = config::read_robot(
      folder_->write("corrected.yaml", corrected_robot(*outcome, folder_->path() / "corrected.yaml")));
  EXPECT_NEAR(corrected.rig.lower.centre_px[0], c.real_robot.rig.lower.centre_px[0] + kShift_px,
              kSigmas * centre->components[0].sigma);
}

TEST_F(Compare, RunsOfOtherLengthRateAndSizeWithAHalfWrittenLastFrameAreComparedWithNotes) {
  const auto real =
      make_run(*folder_, "other", {.driver = "memory", .frames = 8, .rate_hz = 4, .width_px = 240, .height_px = 180});
  const auto file = runlog::upper_image_file(real, 7);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  const auto outcome = compare(settings_for(real, "other_work"));
  ASSERT_TRUE(outcome) << outcome.error().message;
  const Comparison& c = outcome->comparison;
  EXPECT_THAT(c.notes, Contains(HasSubstr("different size (320 x 240 and 240 x 180 px)")));
  EXPECT_THAT(c.notes, Contains(HasSubstr("frame 7 is left out: ")));
  EXPECT_EQ(c.simulated_frames, kFrames);
  EXPECT_EQ(c.real_frames, 7U);
  EXPECT_THAT(differing(c), Contains("frame rate"));
  EXPECT_FALSE(table(c).empty());
}

// One test, because each test makes the run again. All fail before anything is calibrated.
TEST_F(Compare, AnIncompleteRunIsReportedInOneClearLine) {
  auto run = copy_of("no_frames");
  std::filesystem::remove(run / "frames.csv");
  EXPECT_EQ(error_with(run), run.string() + ": there is no frames.csv, so it has no frames");

  run = copy_of("few_frames");
  std::ifstream in(run / "frames.csv");
  std::string text, line;
  for (int i = 0; i < 1 + 3 && std::getline(in, line); ++i) text += line + "\n";
  std::ofstream(run / "frames.csv") << text;
  EXPECT_EQ(error_with(run), run.string() + ": has 3 whole frames, a comparison needs 4 or more");

  run = copy_of("no_sightings");
  std::filesystem::remove(run / "sightings.csv");
  std::filesystem::remove(run / "methods" / "outline" / "sightings.csv");
  EXPECT_EQ(error_with(run), fmt::format("{}: has no sightings of method outline; make them with: twocone localise {} "
                                         "--method outline",
                                         run.string(), run.string()));

  const std::string message = error_with(folder_->path() / "nowhere");
  EXPECT_THAT(message, HasSubstr("nowhere"));
  EXPECT_THAT(message, testing::Not(HasSubstr("\n")));
}

TEST_F(Compare, SettingsOutsideTheirDomainAreNamedTogether) {
  Settings settings = settings_for(simulated_, "never");
  settings.fit_frames = 3;
  settings.false_alarm = 0;
  EXPECT_EQ(testing_support::error_of<std::invalid_argument>([&] { (void)compare(settings); }),
            "compare: fit_frames is 3, must be >= 4; false_alarm is 0, must be within 0 and 1;");
}

}  // namespace
}  // namespace twocone::compare
