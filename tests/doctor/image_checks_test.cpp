// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/estimation/image_as_mat.h"
#include "tests/doctor/bench_devices.h"

namespace twocone::doctor {
namespace {

using testing::HasSubstr;

const vision::RimCircle kBelieved{{79.5, 59.5}, 50, 0};

Report looked_at(const Disc& disc, const std::optional<vision::RimCircle>& believed = kBelieved) {
  Report report;
  check_image("lower", image_of(disc), believed, report);
  return report;
}

struct ImageCase {
  const char* name;
  Disc disc;
  const char* check;
  Verdict verdict;
  const char* advice;
};
void PrintTo(const ImageCase& c, std::ostream* out) { *out << c.name; }

class Images : public testing::TestWithParam<ImageCase> {};

TEST_P(Images, AreJudged) {
  const ImageCase& c = GetParam();
  const Row row = row_of(looked_at(c.disc), "lower", c.check);
  EXPECT_EQ(row.verdict, c.verdict) << row.check << ": " << row.measured;
  EXPECT_THAT(row.advice, HasSubstr(c.advice));
}

const ImageCase kImageCases[] = {{"fine", {}, "exposure", kOk, ""},
                                 {"fine_mirror", {}, "mirror", kOk, ""},
                                 {"fine_focus", {}, "focus", kOk, ""},
                                 {"lens_cap", {.inside = 3, .outside = 2}, "exposure", kFailed, "lens cap"},
                                 {"dim", {.inside = 30, .outside = 90}, "exposure", kWarning, "dark"},
                                 {"bright", {.inside = 220, .outside = 90}, "exposure", kWarning, "bright"},
                                 {"white", {.inside = 255, .outside = 255}, "exposure", kFailed, "white"},
                                 {"no_rim_to_see", {.inside = 100, .outside = 100}, "mirror", kWarning, "in view"},
                                 {"moved", {.column = 81.8}, "mirror", kWarning, "centre_px: [81.8, 59.5]"},
                                 {"moved_far", {.column = 86.5}, "mirror", kFailed, "centre_px: [86.5, 59.5]"},
                                 {"larger", {.radius = 52.6}, "mirror", kWarning, "rim_radius_px: 52.6"},
                                 {"soft", {.sigma_px = 2.4}, "focus", kWarning, "turn the lens"},
                                 {"blurred", {.sigma_px = 4.2}, "focus", kFailed, "turn the lens"}};

INSTANTIATE_TEST_SUITE_P(Each, Images, testing::ValuesIn(kImageCases),
                         [](const auto& each) { return each.param.name; });

// Catches a correct rig that fails where fog or darkness hides the rim.
TEST(DoctorImage, ARimThatIsNotFoundFailsOnlyWhereItCouldBeSeen) {
  EXPECT_EQ(judge_mirror(std::nullopt, true, kBelieved, "lower").verdict, kFailed);
  const Row hidden = judge_mirror(std::nullopt, false, kBelieved, "lower");
  EXPECT_EQ(hidden.verdict, kWarning);
  EXPECT_THAT(hidden.advice, HasSubstr("another brightness"));
}

TEST(DoctorImage, TheWidthOfAnEdgeFollowsItsBlur) {
  // A pixel that samples the blurred edge at its middle gives sqrt(2 pi) sigma, 2.5066 sigma. The slope is measured
  // over a pixel, which widens it like a box of that width, and only nine tenths of the slope's height count.
  constexpr double kShare = 0.12;
  for (const double sigma_px : {1.3, 2.1, 3.3}) {
    const Image image = image_of({.sigma_px = sigma_px});
    const cv::Mat rgb = estimation::as_mat(image);
    const auto width_px = edge_width_px(rgb, kBelieved);
    ASSERT_TRUE(width_px);
    EXPECT_NEAR(*width_px, 2.5066 * sigma_px, kShare * 2.5066 * sigma_px) << "px, sigma " << sigma_px << " px";
  }
}

TEST(DoctorImage, ARimWithLittleContrastGivesNoFocus) {
  const Row row = row_of(looked_at({.inside = 110, .outside = 100}), "lower", "focus");
  EXPECT_EQ(row.verdict, kNotRun) << row.measured;
}

TEST(DoctorImage, OnlyTheMirrorCountsForTheExposure) {
  // A black wall around the mirror does not make the image dark.
  EXPECT_EQ(row_of(looked_at({.inside = 150, .outside = 0}), "lower", "exposure").verdict, kOk);
}

TEST(DoctorImage, ACameraWithoutMirrorHasItsExposureOnly) {
  const Report report = looked_at({}, std::nullopt);
  ASSERT_EQ(report.rows().size(), 1U);
  EXPECT_EQ(report.rows()[0].check, "exposure");
}

}  // namespace
}  // namespace twocone::doctor
