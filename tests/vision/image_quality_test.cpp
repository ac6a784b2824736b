// SPDX-License-Identifier: Apache-2.0
// Noise, transfer and sharpness of images in which all are known.
#include "vision/image_quality.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/vision/image_quality_images.h"

namespace twocone::vision {
namespace {

using image_quality_test::Camera;
using image_quality_test::kLightPerGrey;
using image_quality_test::lab_light;
using image_quality_test::lab_region;
using image_quality_test::room;
using image_quality_test::taken;

// A dozen answers are almost never farther off than this.
constexpr double kAnswerSigmas = 3;

NoiseModel model_of(const Camera& camera, int images) {
  NoiseSamples samples;
  for (int i = 0; i < images; ++i) samples.merge(noise_samples(taken(room(), camera, 71 + i), lab_region()));
  const auto model = fit_noise(samples);
  EXPECT_TRUE(model) << "no level was measured";
  return model.value_or(NoiseModel{});
}

TEST(ImageNoise, WhatIsPlantedIsFound) {
  constexpr double kShare = 0.05;  // accuracy that compare needs: its sigma is at least 1 % and 0.1 grey levels
  for (const double grey : {1.0, 2.0, 4.0, 8.0}) {
    // Half of the variance is of each kind at light kNoiseLevel.
    const double half = grey * grey * kLightPerGrey * kLightPerGrey / 2;
    const Camera camera{.shot = half / kNoiseLevel, .read = std::sqrt(half)};
    const NoiseModel model = model_of(camera, 2);
    EXPECT_NEAR(model.noise_grey, grey, kShare * grey) << "grey levels";
    EXPECT_NEAR(model.noise_grey, grey, kAnswerSigmas * model.sigma_noise_grey) << "grey levels";
    EXPECT_NEAR(model.shot, camera.shot, kAnswerSigmas * model.sigma_shot) << grey << " grey levels";
    EXPECT_NEAR(model.read, camera.read, kAnswerSigmas * model.sigma_read) << grey << " grey levels";
    // The sigmas are small enough: at 4 grey levels, either kind is significantly different from 0.
    if (grey >= 4) {
      EXPECT_GT(model.shot, kAnswerSigmas * model.sigma_shot) << grey << " grey levels";
      EXPECT_GT(model.read, kAnswerSigmas * model.sigma_read) << grey << " grey levels";
    }
    EXPECT_NEAR(model.read_noise_electrons() / model.full_well_electrons(), model.read, 1e-12);
  }
}

TEST(ImageNoise, OneKindIsNotTakenForTheOther) {
  const double variance = 16 * kLightPerGrey * kLightPerGrey;
  const NoiseModel shot = model_of({.shot = variance / kNoiseLevel}, 2);
  EXPECT_LT(shot.read, kAnswerSigmas * shot.sigma_read);
  EXPECT_NEAR(shot.shot, variance / kNoiseLevel, kAnswerSigmas * shot.sigma_shot);
  const NoiseModel read = model_of({.read = std::sqrt(variance)}, 2);
  EXPECT_LT(read.shot, kAnswerSigmas * read.sigma_shot);
  EXPECT_NEAR(read.read, std::sqrt(variance), kAnswerSigmas * read.sigma_read);
}

TEST(ImageNoise, WithoutNoiseThereIsNone) {
  // Rounding to 8 bits scatters by 0.29 grey levels: the answer must be less than that, and less than 3 sigma.
  const NoiseModel model = model_of({}, 1);
  EXPECT_LT(model.noise_grey, 0.29);
  EXPECT_LT(model.noise_grey, kAnswerSigmas * model.sigma_noise_grey);
}

TEST(ImageNoise, MergingInAnyGroupingIsTheSame) {
  NoiseSamples one_by_one, first, rest;
  for (int i = 0; i < 19; ++i) {
    NoiseSamples image;
    image.images = 1;
    image.blocks[0][5] = {.tiles = 100, .level = 20, .variance = 0.01 * i};
    one_by_one.merge(image);
    (i < 7 ? first : rest).merge(image);
  }
  first.merge(rest);
  EXPECT_EQ(first.images, 19U);
  for (std::size_t block = 0; block < NoiseSamples::kBlocks; ++block) {
    EXPECT_EQ(first.blocks[block][5].variance, one_by_one.blocks[block][5].variance) << "block " << block;
  }
}

TEST(ImageNoise, NothingToMeasureIsNoAnswer) {
  EXPECT_FALSE(fit_noise({}));
  const cv::Mat full(480, 640, CV_8UC3, cv::Scalar::all(255));
  EXPECT_FALSE(fit_noise(noise_samples(full, lab_region()))) << "clipped everywhere";
  ImageRegion elsewhere = lab_region();
  elsewhere.centre_px = {5000, 5000};
  EXPECT_FALSE(fit_noise(noise_samples(full, elsewhere)));
}

TEST(ImageTransfer, EqualImagesGiveExactlyNothing) {
  const cv::Mat image = taken(room(), {}, 3);
  const auto answer = transfer(image, image, lab_region());
  ASSERT_TRUE(answer);
  for (const double log_gain : answer->log_gain) EXPECT_EQ(log_gain, 0);
  EXPECT_EQ(answer->vignetting, 0);
}

TEST(ImageTransfer, GainAndVignettingInSpiteOfNoiseShiftAndAMovedLandmark) {
  // The required accuracy of the gain. The mirror shows vignetting up to rho^2 = 0.35 only. Its required accuracy is
  // the value that changes the gain by as much at the rim, times three because the two must be separated.
  constexpr double kGain = 0.005;
  constexpr double kVignetting = 3 * kGain / 0.35;
  const cv::Mat simulated = taken(room(), {}, 3);
  const cv::Mat elsewhere = lab_light(3, 0.1);
  for (const double vignetting : {0.0, 0.3}) {
    const Camera camera{.gain = 1.2, .vignetting = vignetting, .read = 4 * kLightPerGrey};
    const auto answer = transfer(simulated, taken(elsewhere, camera, 5), lab_region());
    ASSERT_TRUE(answer);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(std::exp(answer->log_gain[std::size_t(i)]) / 1.2, 1, kGain) << "channel " << i;
    }
    EXPECT_NEAR(answer->vignetting, vignetting, kVignetting);
  }
}

TEST(ImageTransfer, NothingPlainIsNoAnswer) {
  const cv::Mat black(480, 640, CV_8UC3, cv::Scalar::all(0));
  EXPECT_FALSE(transfer(black, black, lab_region()));
  EXPECT_FALSE(transfer(black(cv::Rect(0, 0, 5, 5)), black(cv::Rect(0, 0, 5, 5)), lab_region()));
}

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

TEST(ImageQuality, WrongArgumentsAreNamed) {
  const cv::Mat image(480, 640, CV_8UC3, cv::Scalar::all(100));
  const cv::Mat grey(480, 640, CV_8UC1, cv::Scalar::all(100));
  EXPECT_THROW(noise_samples(grey, lab_region()), std::invalid_argument);
  EXPECT_THROW(noise_samples({}, lab_region()), std::invalid_argument);
  EXPECT_THROW((void)transfer(image, image(cv::Rect(0, 0, 320, 240)), lab_region()), std::invalid_argument);
  EXPECT_THROW((void)blur_px(grey, lab_region()), std::invalid_argument);
  for (const ImageRegion& none : {ImageRegion{}, ImageRegion{{1, 1}, NAN}, ImageRegion{{1, 1}, 100, 0.5, 0.4}}) {
    EXPECT_THROW(noise_samples(image, none), std::invalid_argument);
    EXPECT_THROW((void)transfer(image, image, none), std::invalid_argument);
    EXPECT_THROW((void)blur_px(image, none), std::invalid_argument);
  }
}

}  // namespace
}  // namespace twocone::vision
