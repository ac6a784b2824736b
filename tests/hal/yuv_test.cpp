// SPDX-License-Identifier: Apache-2.0
// Compares converted Y, U, V images with BT.601's equations in real numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "hal/image.h"
#include "tests/support/fails_with.h"

namespace twocone {
namespace {

// The error that image.h allows: coefficients in 256ths are off by up to 0.0016, times 128 in each of two terms, plus
// one rounding.
constexpr int kEquationsOff = 1;
// OpenCV rounds differently.
constexpr int kOffFromOpenCv = 2;

using Rgb = std::array<int, 3>;
using testing_support::FailsWith;

/// ITU-R BT.601: Y from 16 to 235; U and V up to 112 above and below 128.
Rgb by_the_equations(int y, int u, int v) {
  constexpr double kRed = 0.299;
  constexpr double kBlue = 0.114;
  constexpr double kGreen = 1 - kRed - kBlue;
  const double light = (y - 16) / 219.0;
  const double blue_less_light = (u - 128) / 224.0 * 2 * (1 - kBlue);
  const double red_less_light = (v - 128) / 224.0 * 2 * (1 - kRed);
  const double red = light + red_less_light;
  const double blue = light + blue_less_light;
  const double green = (light - kRed * red - kBlue * blue) / kGreen;
  const auto byte = [](double channel) { return std::clamp(int(std::lround(255 * channel)), 0, 255); };
  return {byte(red), byte(green), byte(blue)};
}

Rgb pixel(const Image& rgb, int column, int row) {
  const auto at = std::size_t(3 * (row * rgb.width_px + column));
  return {rgb.bytes[at], rgb.bytes[at + 1], rgb.bytes[at + 2]};
}

int farthest(const Rgb& a, const Rgb& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

/// A layout: `yuv` returns luma and chroma of pixel (column, row).
struct Layout {
  PixelFormat format;
  std::function<std::array<std::uint8_t, 3>(const Image&, int column, int row)> yuv;
  int opencv;
};
void PrintTo(const Layout& layout, std::ostream* os) { *os << to_string(layout.format); }

const Layout kYuyvLayout{
    PixelFormat::kYuyv,
    [](const Image& image, int column, int row) -> std::array<std::uint8_t, 3> {
      const auto pair = std::size_t(2 * (row * image.width_px + column / 2 * 2));
      return {image.bytes[pair + std::size_t(column % 2 * 2)], image.bytes[pair + 1], image.bytes[pair + 3]};
    },
    cv::COLOR_YUV2RGB_YUYV};
const Layout kUyvyLayout{
    PixelFormat::kUyvy,
    [](const Image& image, int column, int row) -> std::array<std::uint8_t, 3> {
      const auto pair = std::size_t(2 * (row * image.width_px + column / 2 * 2));
      return {image.bytes[pair + 1 + std::size_t(column % 2 * 2)], image.bytes[pair], image.bytes[pair + 2]};
    },
    cv::COLOR_YUV2RGB_UYVY};
const Layout kNv12Layout{PixelFormat::kNv12,
                         [](const Image& image, int column, int row) -> std::array<std::uint8_t, 3> {
                           const auto width = std::size_t(image.width_px);
                           const auto colour =
                               width * std::size_t(image.height_px + row / 2) + std::size_t(column / 2 * 2);
                           return {image.bytes[width * std::size_t(row) + std::size_t(column)], image.bytes[colour],
                                   image.bytes[colour + 1]};
                         },
                         cv::COLOR_YUV2RGB_NV12};

/// An image of pseudo-random bytes, so that two swapped pixels are detected. It is 322 wide, so that a row ends within
/// a vector of the processor.
Image make_image(PixelFormat format, int width_px = 322, int height_px = 6) {
  Image image{width_px, height_px, format, {}};
  std::uint32_t noise = 12345;
  for (std::size_t left = *image_bytes(format, width_px, height_px); left > 0; --left) {
    noise = noise * 1664525 + 1013904223;
    image.bytes.push_back(std::uint8_t(noise >> 24));
  }
  return image;
}

class YuvToRgb8 : public testing::TestWithParam<Layout> {};

TEST_P(YuvToRgb8, FollowsTheEquationsAtEveryPixel) {
  const Image image = make_image(GetParam().format);
  const auto rgb = to_rgb8(image);
  ASSERT_TRUE(rgb);
  ASSERT_EQ(rgb->bytes.size(), *image_bytes(PixelFormat::kRgb8, image.width_px, image.height_px));
  for (int row = 0; row < image.height_px; ++row) {
    for (int column = 0; column < image.width_px; ++column) {
      const auto [y, u, v] = GetParam().yuv(image, column, row);
      ASSERT_LE(farthest(pixel(*rgb, column, row), by_the_equations(y, u, v)), kEquationsOff)
          << "at " << column << ", " << row << ": Y " << int(y) << " U " << int(u) << " V " << int(v);
    }
  }
}

TEST_P(YuvToRgb8, AgreesWithOpenCv) {
  Image image = make_image(GetParam().format);
  const auto rgb = to_rgb8(image);
  ASSERT_TRUE(rgb);
  const bool is_nv12 = image.format == PixelFormat::kNv12;
  const cv::Mat raw(is_nv12 ? image.height_px / 2 * 3 : image.height_px, image.width_px, is_nv12 ? CV_8UC1 : CV_8UC2,
                    image.bytes.data());
  cv::Mat seen;
  cv::cvtColor(raw, seen, GetParam().opencv);
  for (int row = 0; row < image.height_px; ++row) {
    for (int column = 0; column < image.width_px; ++column) {
      if (GetParam().yuv(image, column, row)[0] < 16) continue;  // below black, which OpenCV treats as black
      const auto& theirs = seen.at<cv::Vec3b>(row, column);
      ASSERT_LE(farthest(pixel(*rgb, column, row), {theirs[0], theirs[1], theirs[2]}), kOffFromOpenCv)
          << "at " << column << ", " << row;
    }
  }
}

TEST_P(YuvToRgb8, RefusesOddSides) {
  const PixelFormat format = GetParam().format;
  for (const auto& [width_px, height_px] : {std::pair(3, 2), std::pair(2, 3), std::pair(1, 1)}) {
    if (image_bytes(format, width_px, height_px)) continue;  // layouts with pairs allow an odd height
    for (const std::size_t size : {0u, 6u, 9u, 10u, 12u}) {
      EXPECT_THAT(to_rgb8(Image{width_px, height_px, format, std::vector<std::uint8_t>(size, 9)}),
                  FailsWith(ErrorCode::kBadData))
          << width_px << " x " << height_px << " of " << size << " bytes";
    }
  }
  EXPECT_FALSE(image_bytes(format, 3, 2));
  EXPECT_EQ(image_bytes(format, 2, 3).has_value(), format != PixelFormat::kNv12);
}

INSTANTIATE_TEST_SUITE_P(Layouts, YuvToRgb8, testing::Values(kYuyvLayout, kUyvyLayout, kNv12Layout),
                         [](const auto& layout) { return std::string(to_string(layout.param.format)); });

// Every luma, also with chroma that no real colour has: those values are clipped.
TEST(YuyvToRgb8, FollowsTheEquationsForEveryLumaAndManyColours) {
  constexpr int kStep = 5;  // divides 255, so both ends are included
  for (int u = 0; u < 256; u += kStep) {
    Image image{256, 52, PixelFormat::kYuyv, {}};
    for (int v = 0; v < 256; v += kStep) {
      for (int y = 0; y < 256; ++y) {
        image.bytes.push_back(std::uint8_t(y));
        image.bytes.push_back(std::uint8_t(y % 2 == 0 ? u : v));
      }
    }
    const auto rgb = to_rgb8(image);
    ASSERT_TRUE(rgb);
    for (int v = 0; v < 256; v += kStep) {
      for (int y = 0; y < 256; ++y) {
        ASSERT_LE(farthest(pixel(*rgb, y, v / kStep), by_the_equations(y, u, v)), kEquationsOff)
            << "Y " << y << " U " << u << " V " << v;
      }
    }
  }
}

}  // namespace
}  // namespace twocone
