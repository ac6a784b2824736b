// SPDX-License-Identifier: Apache-2.0
#include "vision/hue_labels.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/srgb.h"
#include "tests/vision/lab_rig.h"

namespace twocone::vision {
namespace {

const std::vector<Eigen::Vector3d> kSix = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}, {1, 1, 0}};

int label_of(const HueLabels& hues, double r, double g, double b) {
  const auto code = [](double linear) { return double(std::lround(testing_support::coded(linear))); };
  const cv::Mat pixel(1, 1, CV_8UC3, cv::Scalar(code(r), code(g), code(b)));
  return hues.label(pixel).at<std::uint8_t>(0, 0);
}

TEST(HueLabels, KnowsEachColourInLightAndShadow) {
  const HueLabels hues(kSix);
  for (const double light : {0.05, 0.3, 0.97}) {
    for (std::size_t k = 0; k < kSix.size(); ++k) {
      const Eigen::Vector3d c = kSix[k] * light + Eigen::Vector3d::Constant(0.03 * light);
      EXPECT_EQ(label_of(hues, c.x(), c.y(), c.z()), int(k) + 1) << "colour " << k << " light " << light;
    }
  }
}

TEST(HueLabels, RefusesGreyPaleDarkAndOtherHues) {
  const HueLabels hues(kSix);
  EXPECT_EQ(label_of(hues, 0.5, 0.5, 0.5), 0);
  EXPECT_EQ(label_of(hues, 0.6, 0.35, 0.35), 0);  // saturation 0.42
  EXPECT_EQ(label_of(hues, 0.005, 0, 0), 0);      // below the least brightness
  EXPECT_EQ(label_of(hues, 0, 0, 0), 0);
  EXPECT_EQ(label_of(hues, 0.8, 0.4, 0), 0);  // hue 30 degrees, between red and yellow
}

TEST(HueLabels, ALandmarkThatCoversMostOfAPixelCounts) {
  const HueLabels hues(kSix);
  const auto mixed = [&hues](double coverage) {
    return label_of(hues, coverage * 0.6 + (1 - coverage) * 0.6, (1 - coverage) * 0.6, (1 - coverage) * 0.6);
  };
  EXPECT_EQ(mixed(0.55), 1);
  EXPECT_EQ(mixed(0.45), 0);
}

TEST(HueLabels, FindsColoursThatCannotBeDistinguished) {
  const HueLabels hues({{1, 0, 0}, {0.9, 0.1, 0}, {0, 0, 1}});
  EXPECT_TRUE(hues.is_ambiguous(0));
  EXPECT_TRUE(hues.is_ambiguous(1));
  EXPECT_FALSE(hues.is_ambiguous(2));
}

TEST(HueLabels, RefusesColoursWithoutHue) {
  EXPECT_THROW(HueLabels({{0.5, 0.5, 0.5}}), std::invalid_argument);
  EXPECT_THROW(HueLabels({{0, 0, 0}}), std::invalid_argument);
  EXPECT_THROW(HueLabels({{-1, 0, 0}}), std::invalid_argument);
  EXPECT_THROW(HueLabels({{std::numeric_limits<double>::quiet_NaN(), 0, 1}}), std::invalid_argument);
}

TEST(HueName, IsTheWordThatPeopleUse) {
  EXPECT_EQ(hue_name({0.8, 0.02, 0.03}), "red");
  EXPECT_EQ(hue_name({0.8, 0.03, 0.02}), "red");
  EXPECT_EQ(hue_name({1, 0.376, 0}), "orange") << "the web's orange";
  EXPECT_EQ(hue_name({0.6, 0.6, 0.02}), "yellow");
  EXPECT_EQ(hue_name({0.02, 0.6, 0.02}), "green");
  EXPECT_EQ(hue_name({0.02, 0.6, 0.6}), "cyan");
  EXPECT_EQ(hue_name({0.02, 0.02, 0.6}), "blue");
  EXPECT_EQ(hue_name({0.3, 0.02, 0.8}), "violet");
  EXPECT_EQ(hue_name({0.6, 0.02, 0.6}), "magenta");
}

}  // namespace
}  // namespace twocone::vision
