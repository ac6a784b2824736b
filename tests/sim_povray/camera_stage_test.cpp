// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/camera_stage.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "drivers/sim_povray/camera/light.h"
#include "tests/support/srgb.h"

namespace twocone::sim_povray {
namespace {

using Images = std::vector<std::shared_ptr<const Image>>;

/// Monte Carlo results must lie within this many of their standard deviations. One correct check in 1.7 million fails;
/// the seeds are fixed, so that a check which has passed always passes.
constexpr double kNoiseSigmas = 5;

// A second implementation of the sRGB curve, as IEC 61966-2-1 defines it.
double linear(double code) {
  const double c = code / 255;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}
int coded(double light) { return static_cast<int>(std::lround(testing_support::coded(std::clamp(light, 0.0, 1.0)))); }

std::shared_ptr<Image> grey(int width_px, int height_px, int code) {
  const std::vector<std::uint8_t> bytes(static_cast<std::size_t>(width_px * height_px * 3),
                                        static_cast<std::uint8_t>(code));
  return std::make_shared<Image>(Image{width_px, height_px, PixelFormat::kRgb8, {bytes.begin(), bytes.end()}});
}

std::shared_ptr<Image> random_image(int width_px, int height_px) {
  auto image = grey(width_px, height_px, 0);
  std::mt19937 random(4711);
  for (std::uint8_t& byte : image->bytes) byte = static_cast<std::uint8_t>(random() % 256);
  return image;
}

Image developed(const CameraEffects& effects, const Images& images, std::uint64_t seed = 7,
                std::string_view camera = "lower", std::uint64_t step = 3,
                std::chrono::nanoseconds now = std::chrono::milliseconds(217)) {
  return develop(effects, images, seed, camera, step, now);
}

int at(const Image& image, int column, int row, int channel = 0) {
  return image.bytes[static_cast<std::size_t>((row * image.width_px + column) * 3 + channel)];
}

struct Moments {
  double mean = 0;
  double variance = 0;
};
Moments moments(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  Moments m{std::accumulate(values.begin(), values.end(), 0.0) / count, 0};
  for (const double value : values) m.variance += (value - m.mean) * (value - m.mean) / (count - 1);
  return m;
}
std::vector<double> lights(const Image& image) {
  std::vector<double> values;
  for (const std::uint8_t byte : image.bytes) values.push_back(linear(byte));
  return values;
}

TEST(Light, EveryCodeComesBack) {
  for (int code = 0; code < 256; ++code) {
    const auto byte = static_cast<std::uint8_t>(code);
    const Light light = mean_light({grey(1, 1, code).get()}, {{{0, 1}}});
    EXPECT_EQ(to_image(light).bytes[0], byte);
    EXPECT_NEAR(light.values.front(), linear(code), 1e-7) << "a float's rounding, code " << code;
  }
}

TEST(Light, IsCodedByTheCurveAndClipped) {
  const auto code_of = [](float light) { return to_image({1, 1, {light, light, light}}).bytes[0]; };
  int different = 0;
  for (int i = -1000; i <= 21'000; ++i) {
    const double light = i / 20'000.0;
    different += code_of(static_cast<float>(light)) == coded(light) ? 0 : 1;
  }
  // They differ only where a float's rounding crosses one of 255 steps: 22'000 * 255 * 6e-8 = 0.3 are expected.
  EXPECT_LE(different, 3);
  EXPECT_EQ(code_of(1e30F), 255);
  EXPECT_EQ(code_of(-1e30F), 0);
  EXPECT_EQ(code_of(NAN), 0);
}

TEST(CameraStage, WithoutEffectsThePixelsAreUnchanged) {
  const CameraEffects losing{
      .distortion = {0, 0, 0, 0}, .drop_probability = 0.4, .late_probability = 0.3, .stamp_late_s = 0.04};
  for (const CameraEffects& effects : {CameraEffects{}, losing}) {
    EXPECT_FALSE(changes_pixels(effects));
    EXPECT_FALSE(takes_time(effects));
    const auto source = random_image(37, 23);
    EXPECT_EQ(developed(effects, {source}), *source);
  }
}

TEST(CameraStage, EveryStageAtItsNeutralValueKeepsThePixels) {
  for (const auto& [width_px, height_px] : {std::pair(64, 48), std::pair(37, 23), std::pair(1, 1), std::pair(2, 300)}) {
    const auto source = random_image(width_px, height_px);
    EXPECT_EQ(pass_through(*source), *source) << width_px << " x " << height_px;
  }
  auto all_codes = grey(256, 1, 0);
  for (std::size_t i = 0; i < all_codes->bytes.size(); ++i) all_codes->bytes[i] = static_cast<std::uint8_t>(i / 3);
  EXPECT_EQ(pass_through(*all_codes), *all_codes);
}

TEST(CameraStage, ShutterSamplesThatDoNotFitAreRefused) {
  CameraEffects effects;
  EXPECT_THROW((void)developed(effects, {}), std::invalid_argument);
  effects.exposure_time_s = 0.01;
  effects.shutter_samples = 3;
  EXPECT_THROW((void)developed(effects, {grey(4, 4, 1)}), std::invalid_argument);
  EXPECT_THROW((void)developed(effects, {grey(4, 4, 1), grey(4, 4, 1), grey(4, 5, 1)}), std::invalid_argument);
  auto short_one = grey(4, 4, 1);
  short_one->bytes.resize(short_one->bytes.size() - 1);
  EXPECT_THROW((void)developed(effects, {grey(4, 4, 1), grey(4, 4, 1), short_one}), std::invalid_argument);
}

// ---- gain, vignetting, defocus

TEST(Gain, DoublesLinearLightNotTheCode) {
  CameraEffects effects{.gain = 2};
  const auto source = random_image(31, 17);
  const Image bright = developed(effects, {source});
  for (std::size_t i = 0; i < bright.bytes.size(); ++i) {
    ASSERT_EQ(bright.bytes[i], coded(2 * linear(source->bytes[i]))) << "code " << int(source->bytes[i]);
  }
}

TEST(Vignetting, TakesItsShareInTheCornersAndGrowsWithTheRadiusSquared) {
  CameraEffects effects{.vignetting = 0.37};
  const Image image = developed(effects, {grey(41, 31, 255)});
  for (const auto& [column, row] : {std::pair(0, 0), std::pair(40, 0), std::pair(0, 30), std::pair(40, 30)}) {
    EXPECT_EQ(at(image, column, row), coded(1 - 0.37)) << "corner " << column << ", " << row;
  }
  EXPECT_EQ(at(image, 20, 15), 255) << "the centre keeps all";
  EXPECT_EQ(at(image, 40, 15), coded(1 - 0.37 * 20 * 20 / (20 * 20 + 15 * 15.0))) << "middle of the right edge";
  EXPECT_EQ(at(image, 27, 4), coded(1 - 0.37 * (7 * 7 + 11 * 11) / (20 * 20 + 15 * 15.0)));
}

Light point_of_light(int side_px) {
  Light light{side_px, side_px, std::vector<float>(static_cast<std::size_t>(side_px * side_px * 3))};
  const auto middle = static_cast<std::size_t>((side_px / 2 * side_px + side_px / 2) * 3);
  for (std::size_t channel = 0; channel < 3; ++channel) light.values[middle + channel] = 1;
  return light;
}

TEST(Defocus, SpreadsAPointEvenlyOverItsDiscAndKeepsTheLight) {
  constexpr int kSide = 41;
  // The share of each pixel at the rim is counted on a grid of 16 x 16 points. The rim has 2 pi r pixels, and each may
  // be wrong by one point per row: together less than 2 pi r / 16 of the area pi r^2, which is 1 / (8 r).
  for (const double radius_px : {1.7, 4.3, 9.6}) {
    const Light light = defocused(point_of_light(kSide), radius_px);
    double sum = 0;
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) {
        const double share = light.values[static_cast<std::size_t>((row * kSide + column) * 3 + 1)];
        const double away_px = std::hypot(row - kSide / 2, column - kSide / 2);
        sum += share;
        const double even = 1 / (std::numbers::pi * radius_px * radius_px);
        // 0.71 px: from a pixel's centre to its corner.
        if (away_px > radius_px + 0.71) {
          EXPECT_EQ(share, 0) << radius_px << " px, " << away_px << " px away";
        } else if (away_px < radius_px - 0.71) {
          EXPECT_NEAR(share, even, even / (8 * radius_px)) << radius_px << " px";
        }
      }
    }
    EXPECT_NEAR(sum, 1, 1e-5) << "300 floats' rounding, radius " << radius_px << " px";
  }
}

TEST(Defocus, LeavesAnEvenImageAsItIsUpToTheEdges) {
  CameraEffects effects{.defocus_px = 3.3};
  const auto source = grey(5, 9, 137);  // narrower than the disc
  EXPECT_EQ(developed(effects, {source}), *source);
  effects.defocus_px = 0.45;
  EXPECT_EQ(developed(effects, {random_image(9, 9)}), *random_image(9, 9)) << "a disc within one pixel";
}

TEST(Defocus, IsLinearLightNotTheMeanOfCodes) {
  CameraEffects effects{.defocus_px = 20};
  auto source = grey(2, 1, 0);
  for (std::size_t i = 0; i < 3; ++i) source->bytes[i] = 255;
  const Image image = developed(effects, {source});
  // The image continues to the left of its edge: half of the disc is white, and in addition half of its middle column,
  // which is 2 r of pi r^2.
  EXPECT_NEAR(at(image, 0, 0), coded(0.5 + 1 / (std::numbers::pi * 20)), 1);
}

// ---- lamps

TEST(ColourGain, MultipliesEachChannelInLinearLight) {
  CameraEffects effects{.colour_gain = {1.13, 0.94, 0.71}};
  EXPECT_TRUE(changes_pixels(effects));
  const auto source = random_image(31, 17);
  const Image image = developed(effects, {source});
  for (std::size_t i = 0; i < image.bytes.size(); ++i) {
    ASSERT_EQ(image.bytes[i], coded(effects.colour_gain[i % 3] * linear(source->bytes[i]))) << "channel " << i % 3;
  }
}

/// Returns what the lamps give of their mean light at a time, as a plain image of no exposure shows it.
double lamps_at(double time_s, double flicker, std::uint64_t seed, std::string_view camera) {
  constexpr int kGrey = 150;
  const Image image = developed({.flicker = flicker}, {grey(2, 3, kGrey)}, seed, camera, 3,
                                std::chrono::nanoseconds(std::llround(time_s * 1e9)));
  EXPECT_EQ(at(image, 0, 0), at(image, 1, 2)) << "all rows at once";
  return linear(at(image, 0, 0)) / linear(kGrey);
}

// A code at 150 is 1.3 % of its light, so rounding is up to 0.7 % of it.
constexpr double kRoundedLight = 0.007;

TEST(Flicker, IsOfTwiceTheMainsFrequencyAndOfOnePhaseForAllCameras) {
  constexpr double kFlicker = 0.4;
  for (const double time_s : {0.0, 0.0173, 4.0039}) {
    const double now = lamps_at(time_s, kFlicker, 7, "lower");
    EXPECT_EQ(lamps_at(time_s, kFlicker, 7, "upper"), now);
    EXPECT_NEAR(lamps_at(time_s + 0.37, kFlicker, 7, "lower"), now, 1e-9) << "37 whole periods later";
    EXPECT_NEAR(lamps_at(time_s + 0.005, kFlicker, 7, "lower"), 2 - now, 2 * kRoundedLight) << "half a period later";
    const double quarter = lamps_at(time_s + 0.0025, kFlicker, 7, "lower");
    EXPECT_NEAR(std::hypot(now - 1, quarter - 1), kFlicker, 2 * kRoundedLight) << "a quarter of a period later";
  }
  EXPECT_NE(lamps_at(0, kFlicker, 8, "lower"), lamps_at(0, kFlicker, 7, "lower")) << "another seed";
}

TEST(Flicker, OfARowIsTheMeanOverItsOwnExposure) {
  constexpr double kFlicker = 0.4;
  constexpr int kRows = 37;
  constexpr double kNow_s = 0.317;
  const double cosine = lamps_at(0, kFlicker, 7, "lower") - 1, sine = 1 - lamps_at(0.0025, kFlicker, 7, "lower");
  for (const auto& [exposure_time_s, readout_s, late_s] :
       {std::tuple(0.0037, 0.0131, 0.0), std::tuple(0.0037, 0.0, 0.0), std::tuple(0.0, 0.0131, 0.0171)}) {
    const CameraEffects effects{.exposure_time_s = exposure_time_s,
                                .readout_s = readout_s,
                                .shutter_samples = 2,
                                .stamp_late_s = late_s,
                                .flicker = kFlicker};
    const Image image =
        developed(effects, {grey(1, kRows, 150), grey(1, kRows, 150)}, 7, "lower", 3, std::chrono::milliseconds(317));
    for (int row = 0; row < kRows; ++row) {
      // The last row's shutter closes now, or as much earlier as the stamp is late.
      const double closed_s = kNow_s - late_s - readout_s * (kRows - 1 - row) / (kRows - 1);
      constexpr int kPoints = 200;
      double mean = 0;
      for (int i = 0; i < kPoints; ++i) {
        const double turns = 100 * (closed_s - exposure_time_s * (i + 0.5) / kPoints);
        const double angle = 2 * std::numbers::pi * turns;
        mean += (1 + cosine * std::cos(angle) - sine * std::sin(angle)) / kPoints;
      }
      // Three roundings: of both phases and of this pixel.
      EXPECT_NEAR(linear(at(image, 0, row)) / linear(150), mean, 3 * kRoundedLight)
          << "row " << row << ", exposure " << exposure_time_s << " s, readout " << readout_s << " s";
    }
  }
}

TEST(Flicker, IsGoneWithAnExposureOfAWholePeriod) {
  const auto source = grey(3, 50, 150);
  const CameraEffects effects{.exposure_time_s = 0.01, .readout_s = 0.012, .shutter_samples = 2, .flicker = 0.8};
  EXPECT_EQ(developed(effects, {source, source}), *source);
}

// ---- compression

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.bytes.size(); ++i) sum += std::abs(int(a.bytes[i]) - int(b.bytes[i]));
  return sum / double(a.bytes.size());
}

TEST(Jpeg, LosesMoreWithLessQualityAndAlmostNothingWithTheBest) {
  auto source = grey(48, 32, 1);
  for (int i = 0; i < 48 * 32; ++i) {
    const double wave = std::sin(i % 48 / 2.7) + std::cos(i / 48 / 1.9);
    for (int c = 0; c < 3; ++c) source->bytes[std::size_t(3 * i + c)] = std::uint8_t(128 + 40 * wave);
  }
  const auto lost = [&](int quality) {
    return mean_difference(developed({.jpeg_quality = quality}, {source}), *source);
  };
  EXPECT_LT(lost(100), 0.5) << "rounding alone: grey has no colour to lose";
  EXPECT_LT(lost(100), lost(85));
  EXPECT_LT(2 * lost(85), lost(20));
  EXPECT_GT(lost(85), 0.3);
}

TEST(Jpeg, HasOneColourForTwoPixelsOfARowAndOneForEachRow) {
  constexpr int kSide = 16;
  const auto stripes = [](bool upright) {
    auto image = grey(kSide, kSide, 60);
    for (int i = 0; i < kSide * kSide; ++i) {
      const int stripe = upright ? i % kSide : i / kSide;
      image->bytes[std::size_t(3 * i + (stripe % 2 == 0 ? 0 : 2))] = 180;  // red or blue
    }
    return image;
  };
  const auto redness = [](const Image& image, int column, int row) {
    return at(image, column, row, 0) - at(image, column, row, 2);
  };
  const Image rows = developed({.jpeg_quality = 95}, {stripes(false)});
  EXPECT_GT(redness(rows, 5, 6), 90);
  EXPECT_LT(redness(rows, 5, 7), -90);
  const Image columns = developed({.jpeg_quality = 95}, {stripes(true)});
  EXPECT_LT(std::abs(redness(columns, 6, 5)), 30);
  EXPECT_LT(std::abs(redness(columns, 7, 5)), 30);
}

TEST(Jpeg, KeepsBlackWhatWasNotRendered) {
  auto source = random_image(40, 24);
  for (std::size_t i = 0; i < 3 * 40 * 11; ++i) source->bytes[i] = 0;  // up to the middle of a block
  const Image image = developed({.jpeg_quality = 30}, {source});
  for (std::size_t i = 0; i < 3 * 40 * 11; ++i) ASSERT_EQ(image.bytes[i], 0);
}

// ---- distortion

/// OpenCV's distortion model, as its documentation defines it.
LensPoint through_lens(const std::vector<double>& k, double x, double y) {
  const double r2 = x * x + y * y;
  const double k3 = k.size() > 4 ? k[4] : 0;
  const double radial = 1 + k[0] * r2 + k[1] * r2 * r2 + k3 * r2 * r2 * r2;
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

const std::vector<std::vector<double>> kLenses = {
    {-0.21, 0.043, 0.0013, -0.0021}, {0.17, -0.02, -0.003, 0.0017, 0.011}, {-0.08, 0.11, 0.004, 0.003, -0.06}};

TEST(Distortion, ThroughTheLensAndBackIsThePointItself) {
  std::mt19937 random(99);
  std::uniform_real_distribution<double> side(-0.6, 0.6);
  for (const auto& k : kLenses) {
    for (int i = 0; i < 500; ++i) {
      const LensPoint ideal{side(random), side(random)};
      const LensPoint seen = through_lens(k, ideal.x, ideal.y);
      // undistort stops at 1e-9; the lens shrinks by a factor of two at most here.
      EXPECT_NEAR(undistort(k, seen).x, ideal.x, 2e-9);
      EXPECT_NEAR(undistort(k, seen).y, ideal.y, 2e-9);
    }
  }
}

TEST(Distortion, BeyondTheFoldNothingIsSeen) {
  // r (1 - 0.3 r^2) is greatest, 0.703, at r = 1.054.
  EXPECT_NEAR(undistort({-0.3, 0, 0, 0}, {0.7, 0}).x, 1.0, 1e-8);
  EXPECT_TRUE(std::isnan(undistort({-0.3, 0, 0, 0}, {0.71, 0}).x));
  EXPECT_TRUE(std::isnan(undistort({-0.3, 0, 0, 0}, {-5, 3}).x));
}

TEST(Distortion, OfASlopeEqualsASlowReference) {
  // Bilinear interpolation reproduces a plane in linear light, so that only a wrong place makes a difference. The
  // reference is the fixed-point iteration x <- x + (seen - lens(x)), run until it no longer changes.
  constexpr int kWidth = 53;
  constexpr int kHeight = 41;
  constexpr double kFocal_px = 47.3;
  constexpr double kFloat = 1e-6;  // a few roundings of values up to 1
  const auto slope = [](double x, double y) { return 0.1 + 0.009 * x + 0.007 * y; };
  Light ideal{kWidth, kHeight, {}};
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      ideal.values.insert(ideal.values.end(), 3, static_cast<float>(slope(column, row)));
    }
  }
  for (const auto& k : kLenses) {
    const Light seen = distorted(ideal, k, kFocal_px);
    int black = 0;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const LensPoint target{(column - 26) / kFocal_px, (row - 20) / kFocal_px};
        LensPoint p = target;
        for (int i = 0; i < 300; ++i) {
          const LensPoint now = through_lens(k, p.x, p.y);
          p = {p.x + target.x - now.x, p.y + target.y - now.y};
        }
        const double x = p.x * kFocal_px + 26;
        const double y = p.y * kFocal_px + 20;
        const float value = seen.values[static_cast<std::size_t>((row * kWidth + column) * 3 + 2)];
        if (x < -0.5 || x > kWidth - 0.5 || y < -0.5 || y > kHeight - 0.5) {
          ASSERT_EQ(value, 0) << "outside the ideal image: " << x << ", " << y;
          ++black;
        } else {
          ASSERT_NEAR(value, slope(std::clamp(x, 0.0, kWidth - 1.0), std::clamp(y, 0.0, kHeight - 1.0)), kFloat)
              << column << ", " << row;
        }
      }
    }
    EXPECT_EQ(black > 0, k[0] < 0) << "a barrel lens sees more than the image has";
  }
}

// ---- time

TEST(ShutterSamples, AreTheMiddlesOfEqualPartsEndingNow) {
  CameraEffects effects{.exposure_time_s = 0.013, .readout_s = 0.021, .shutter_samples = 5};
  const auto before = shutter_samples_before(effects);
  ASSERT_EQ(before.size(), 5u);
  EXPECT_EQ(before.front().count(), 30'600'000) << "34 ms less a tenth, oldest first";
  EXPECT_EQ(before.back().count(), 3'400'000);
  EXPECT_EQ(capture_before(effects).count(), 17'000'000);
  EXPECT_EQ(before[2], capture_before(effects)) << "the middle sample is the capture time";
  EXPECT_EQ(shutter_samples_before({}), std::vector{std::chrono::nanoseconds(0)});
  EXPECT_EQ(capture_before({}).count(), 0);
}

// Catches an implementation that moves the stamp too, so that the stamp is not late.
TEST(ShutterSamples, AreAllOlderByTheDelayOfTheStamp) {
  CameraEffects effects{.stamp_late_s = 0.0173};
  EXPECT_EQ(shutter_samples_before(effects), std::vector{std::chrono::nanoseconds(17'300'000)}) << "still one image";
  EXPECT_EQ(capture_before(effects).count(), 0);
  effects.exposure_time_s = 0.013;
  effects.readout_s = 0.021;
  effects.shutter_samples = 5;
  CameraEffects in_time = effects;
  in_time.stamp_late_s = 0;
  auto wanted = shutter_samples_before(in_time);
  for (auto& before : wanted) before += std::chrono::nanoseconds(17'300'000);
  EXPECT_EQ(shutter_samples_before(effects), wanted);
  EXPECT_EQ(capture_before(effects), capture_before(in_time));
}

/// Every pixel of shutter sample i has the code 25 (i + 1).
Images one_colour_each(int count, int height_px) {
  Images images;
  for (int i = 0; i < count; ++i) images.push_back(grey(3, height_px, 25 * (i + 1)));
  return images;
}

TEST(MotionBlur, IsTheMeanLightOfAllShutterSamples) {
  CameraEffects effects{.exposure_time_s = 0.02, .shutter_samples = 7};
  double mean = 0;
  for (int i = 0; i < 7; ++i) mean += linear(25 * (i + 1)) / 7;
  EXPECT_EQ(developed(effects, one_colour_each(7, 11)), *grey(3, 11, coded(mean)));
}

/// Light that grows with time: of each row, it shows the mean time while its shutter was open.
TEST(RollingShutter, EveryRowIsOfTheMiddleOfItsOwnTime) {
  constexpr int kRows = 241;
  for (const auto& [exposure_time_s, readout_s, count] :
       {std::tuple(0.0107, 0.0231, 8), std::tuple(0.0, 0.0231, 9), std::tuple(0.0011, 0.0307, 4),
        std::tuple(0.00614, 0.0014, 8)}) {
    CameraEffects effects{.exposure_time_s = exposure_time_s, .readout_s = readout_s, .shutter_samples = count};
    const auto before = shutter_samples_before(effects);
    const double whole_s = exposure_time_s + readout_s;
    const auto light_at = [&](double before_now_s) { return 0.9 - 0.8 * before_now_s / whole_s; };
    Images images;
    for (const auto& time : before) {
      images.push_back(grey(3, kRows, coded(light_at(std::chrono::duration<double>(time).count()))));
    }
    const Image image = developed(effects, images);
    const double interval_s = whole_s / count;
    for (int row = 0; row < kRows; ++row) {
      // Times count back from now: the shutter of the last row closes at 0.
      const double closed_s = readout_s * (kRows - 1 - row) / (kRows - 1);
      const double middle_s = closed_s + exposure_time_s / 2;
      // Before the first sample and after the last, half an interval, light stands still.
      const double beyond_s =
          std::max({0.0, interval_s / 2 - closed_s, closed_s + exposure_time_s - (whole_s - interval_s / 2)});
      const double off_s =
          exposure_time_s > 0 ? std::min(beyond_s * beyond_s / 2 / exposure_time_s, beyond_s) : beyond_s;
      const double code = coded(light_at(middle_s));
      const double slack = std::abs(coded(light_at(middle_s + off_s)) - code) + 2;  // roundings of samples and image
      EXPECT_NEAR(at(image, 1, row), code, slack)
          << "row " << row << " of exposure " << exposure_time_s << " s, readout " << readout_s << " s";
    }
    EXPECT_LT(at(image, 1, 0), at(image, 1, kRows - 1)) << "the first row is the oldest";
  }
}

TEST(RollingShutter, UsesNoOtherRowsOfASampleThanThoseItNames) {
  constexpr int kRows = 31, kCount = 8;
  const CameraEffects effects{.exposure_time_s = 0.0107, .readout_s = 0.0231, .shutter_samples = kCount};
  const auto rows = rows_of_shutter_samples(effects, kRows);
  ASSERT_EQ(rows.size(), std::size_t(kCount));
  const Images whole = one_colour_each(kCount, kRows);
  Images needed;
  int left_out = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto image = *whole[i];
    for (int row = 0; row < kRows; ++row) {
      if (row >= rows[i].first && row <= rows[i].last) continue;
      std::fill_n(image.bytes.begin() + 9 * row, 9, std::uint8_t{7});
      ++left_out;
    }
    needed.push_back(std::make_shared<const Image>(image));
  }
  EXPECT_EQ(developed(effects, needed), developed(effects, whole));
  // A row's shutter is open for a third of the time, and a sample counts for an interval before it and one after.
  EXPECT_GT(left_out, kCount * kRows * 2 / 5);
}

// ---- noise

TEST(Normal, HasTheMomentsAndTheTailOfANormalDistribution) {
  constexpr int kDraws = 1'000'000;
  Normal normal(std::mt19937_64(20250607));
  std::array<double, 5> power{};
  int beyond_tail = 0;
  int beyond_one = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double z = normal();
    for (std::size_t n = 1; n < power.size(); ++n) power[n] += std::pow(z, static_cast<double>(n)) / kDraws;
    beyond_tail += std::abs(z) > 3.5 ? 1 : 0;
    beyond_one += std::abs(z) > 1 ? 1 : 0;
  }
  // Variances of the means of z, z^2, z^3, z^4: 1, 2, 15, 96 over the number of draws.
  EXPECT_NEAR(power[1], 0, kNoiseSigmas * std::sqrt(1.0 / kDraws));
  EXPECT_NEAR(power[2], 1, kNoiseSigmas * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(power[3], 0, kNoiseSigmas * std::sqrt(15.0 / kDraws));
  EXPECT_NEAR(power[4], 3, kNoiseSigmas * std::sqrt(96.0 / kDraws));
  for (const auto& [limit, count] : {std::pair(3.5, beyond_tail), std::pair(1.0, beyond_one)}) {
    const double expected = kDraws * std::erfc(limit / std::numbers::sqrt2);
    EXPECT_NEAR(count, expected, kNoiseSigmas * std::sqrt(expected)) << "beyond " << limit;
  }
}

struct NoiseCase {
  const char* name;
  double gain, full_well_electrons, read_noise_electrons;
  friend void PrintTo(const NoiseCase& noise, std::ostream* out) { *out << noise.name; }
};
class Noise : public testing::TestWithParam<NoiseCase> {};

TEST_P(Noise, HasTheStatedVarianceAndNoBias) {
  const auto& [name, gain, full_well, read_noise] = GetParam();
  CameraEffects effects{.gain = gain, .full_well_electrons = full_well, .read_noise_electrons = read_noise};
  constexpr int kCode = 124;
  const Image noisy = developed(effects, {grey(200, 150, kCode)});
  const Moments found = moments(lights(noisy));
  const double light = gain * linear(kCode);
  // Rounding to codes adds step^2 / 12 (Sheppard). The curve is nearly straight over a few sigma, and its curvature
  // moves the mean of the rounding by less than a hundredth of a step.
  const int code = coded(light);
  const double step = (linear(code + 1) - linear(code - 1)) / 2;
  const double variance = light / full_well + std::pow(read_noise / full_well, 2) + step * step / 12;
  const auto count = static_cast<double>(noisy.bytes.size());
  EXPECT_NEAR(found.variance / variance, 1, kNoiseSigmas * std::sqrt(2 / count));
  EXPECT_NEAR(found.mean, light, kNoiseSigmas * std::sqrt(variance / count) + step / 100);
}

INSTANTIATE_TEST_SUITE_P(All, Noise,
                         testing::Values(NoiseCase{"Shot", 1, 900, 0}, NoiseCase{"ShotAfterGain", 1.7, 900, 0},
                                         NoiseCase{"Read", 1, 1e9, 2e7}, NoiseCase{"Both", 1, 1500, 20}),
                         [](const auto& param) { return param.param.name; });

CameraEffects noisy() { return {.full_well_electrons = 700, .read_noise_electrons = 9}; }

TEST(Draws, OfOneSeedCameraAndStepAreTheSameBytes) {
  const Images source = {random_image(40, 30)};
  const Image image = developed(noisy(), source, 7, "lower", 3);
  EXPECT_EQ(developed(noisy(), source, 7, "lower", 3), image);
  EXPECT_NE(developed(noisy(), source, 8, "lower", 3), image);
  EXPECT_NE(developed(noisy(), source, 7 + (1ULL << 32), "lower", 3), image) << "the seed's upper half counts";
  EXPECT_NE(developed(noisy(), source, 7, "upper", 3), image);
  EXPECT_NE(developed(noisy(), source, 7, "lower", 4), image);
  EXPECT_NE(developed(noisy(), source, 7, "lower", 3 + (1ULL << 32)), image);
}

TEST(Draws, OfOneEffectDoNotDependOnOthers) {
  // The other effects are too weak to change a byte. Only random draws that effects share would change the image.
  const Images source = {grey(40, 30, 150)};
  CameraEffects shot = noisy();
  shot.read_noise_electrons = 0;
  const Image image = developed(shot, source);
  CameraEffects more = shot;
  more.read_noise_electrons = 1e-9;
  more.vignetting = 1e-9;
  more.defocus_px = 0.01;
  more.distortion = {1e-12, 0, 0, 0};
  more.distortion_focal_px = 50;
  more.drop_probability = 0.5;
  more.late_probability = 0.5;
  EXPECT_EQ(developed(more, source), image);
}

TEST(Draws, OfTwoPurposesAndTwoCamerasAreUncorrelated) {
  constexpr int kDraws = 20'000;
  const auto draws = [](CameraPurpose purpose, std::string_view camera) {
    return Normal(camera_engine(7, purpose, camera, 3));
  };
  const std::pair<Normal, Normal> pairs[] = {
      {draws(CameraPurpose::kShotNoise, "lower"), draws(CameraPurpose::kReadNoise, "lower")},
      {draws(CameraPurpose::kShotNoise, "lower"), draws(CameraPurpose::kShotNoise, "upper")}};
  for (auto [one, other] : pairs) {
    double product = 0;
    for (int i = 0; i < kDraws; ++i) product += one() * other() / kDraws;
    EXPECT_NEAR(product, 0, kNoiseSigmas / std::sqrt(kDraws));
  }
}

TEST(Draws, AreStillThoseOfEarlierVersions) {
  // The recipe is a seed sequence of seed, purpose, FNV-1a of the name and step; each 64 bits are two words, the low
  // word first.
  std::uint64_t name = 14695981039346656037ULL;
  for (const unsigned char c : {'u', 'p', 'p', 'e', 'r'}) name = (name ^ c) * 1099511628211ULL;
  std::seed_seq words{5U, 2U, 103U, static_cast<unsigned>(name), static_cast<unsigned>(name >> 32), 9U, 1U};
  EXPECT_EQ(camera_engine(5 + (2ULL << 32), CameraPurpose::kDrop, "upper", 9 + (1ULL << 32))(),
            std::mt19937_64(words)());
}

TEST(Losses, HappenAtTheirRatesAndIndependently) {
  constexpr int kSteps = 4000;
  CameraEffects effects{.drop_probability = 0.13, .late_probability = 0.21};
  int dropped = 0, late = 0, both = 0;
  for (std::uint64_t step = 0; step < kSteps; ++step) {
    const bool is_dropped = drops(effects, 7, "lower", step);
    const bool comes_late = is_late(effects, 7, "lower", step);
    dropped += is_dropped ? 1 : 0;
    late += comes_late ? 1 : 0;
    both += is_dropped && comes_late ? 1 : 0;
  }
  const auto check = [&](int count, double p, const char* what) {
    EXPECT_NEAR(count, kSteps * p, kNoiseSigmas * std::sqrt(kSteps * p * (1 - p))) << what;
  };
  check(dropped, 0.13, "dropped");
  check(late, 0.21, "late");
  check(both, 0.13 * 0.21, "both: they are independent");
  for (std::uint64_t step = 0; step < 50; ++step) {
    EXPECT_FALSE(drops({}, 7, "lower", step));
    EXPECT_FALSE(is_late({}, 7, "lower", step));
  }
}

}  // namespace
}  // namespace twocone::sim_povray
