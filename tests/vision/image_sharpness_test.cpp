// SPDX-License-Identifier: Apache-2.0
// Sharpness of images whose blur is known.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/vision/image_quality_images.h"
#include "vision/image_quality.h"

namespace twocone::vision {
namespace {

using image_quality_test::kLightPerGrey;
using image_quality_test::lab_region;
using image_quality_test::room;
using image_quality_test::taken;

// The required accuracy: a defocus of a pixel, 0.3 to 0.5 px of spread, is distinguished from none at three times this.
constexpr double kSpread_px = 0.1;
constexpr double kNoise_px = 0.05;

double spread_of(double defocus_px, double noise_grey) {
  const cv::Mat image = taken(room(), {.read = noise_grey * kLightPerGrey, .defocus_px = defocus_px}, 11);
  return blur_px(image, lab_region()).value_or(NAN);
}

TEST(ImageSharpness, PixelsThatHoldTheMeanOverTheirSquare) {
  // 1/12 px^2 for the square, and 1/12 px^2 for the pixel's own.
  EXPECT_NEAR(spread_of(0, 0), std::sqrt(1. / 6), kSpread_px);
}

TEST(ImageSharpness, GaussianSpreadIsExact) {
  // The image has one straight edge at an angle and nothing else. The remaining error is the next term of the
  // differences, 0.02 / 0.9 px^2 of variance for the sharpest; the samples of the narrow smoothing and 8 bits add as
  // much again.
  constexpr double kExact_px = 0.04;
  for (const double sigma_px : {0.6, 1.1, 1.9}) {
    cv::Mat light(480, 640, CV_32FC3);
    for (int row = 0; row < light.rows; ++row) {
      for (int column = 0; column < light.cols; ++column) {
        const double across_px = (column - 319.5) * std::cos(0.3) + (row - 239.5) * std::sin(0.3);
        light.at<cv::Vec3f>(row, column) =
            cv::Vec3f::all(float(0.4 + 0.15 * std::erf(across_px / sigma_px / std::sqrt(2))));
      }
    }
    const auto found = blur_px(taken(light, {}, 1), lab_region());
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, std::sqrt(sigma_px * sigma_px + 1. / 12), kExact_px) << "sigma " << sigma_px << " px";
  }
}

TEST(ImageSharpness, DefocusIsFoundInSpiteOfNoise) {
  const double sharp = spread_of(0, 0);
  for (const double noise_grey : {0.0, 4.0}) {
    EXPECT_NEAR(spread_of(0, noise_grey), sharp, kNoise_px);
    for (const double radius_px : {1.0, 2.0}) {
      const double blurred = spread_of(radius_px, noise_grey);
      EXPECT_GT(blurred, sharp + 2 * kSpread_px) << radius_px << " px, noise " << noise_grey;
      EXPECT_NEAR(defocus_radius_px(sharp, blurred), radius_px, kSpread_px) << "noise " << noise_grey;
    }
  }
  EXPECT_EQ(defocus_radius_px(0.5, 0.5), 0);
  EXPECT_EQ(defocus_radius_px(0.5, 0.4), 0);
}

TEST(ImageSharpness, AGainChangesNothing) {
  const cv::Mat darker = taken(room(), {.gain = 0.5}, 11);
  EXPECT_NEAR(blur_px(darker, lab_region()).value_or(NAN), spread_of(0, 0), kNoise_px);
}

TEST(ImageSharpness, NoEdgesIsNoAnswer) {
  EXPECT_FALSE(blur_px(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(100)), lab_region()));
  EXPECT_FALSE(blur_px(cv::Mat(5, 5, CV_8UC3, cv::Scalar::all(100)), lab_region()));
}

}  // namespace
}  // namespace twocone::vision
