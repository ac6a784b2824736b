// SPDX-License-Identifier: Apache-2.0
// MJPG: each image is a JPEG, as cameras send it or as it arrives over a bad cable.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>

#include "hal/image.h"
#include "tests/support/fails_with.h"

namespace twocone {
namespace {

// The sides are not multiples of a JPEG's block size.
constexpr int kWidthPx = 53;
constexpr int kHeightPx = 37;
// At quality 95, quantisation steps are about 1. Halved chroma resolution blurs a gradient of 3 per pixel.
constexpr int kJpegOff = 12;
constexpr double kMeanOff = 2.5;

using Jpeg = std::vector<std::uint8_t>;
using testing::HasSubstr;
using testing_support::FailsWith;

/// A smooth image with three different channels.
Image image() {
  Image rgb{kWidthPx, kHeightPx, PixelFormat::kRgb8, {}};
  for (int row = 0; row < kHeightPx; ++row) {
    for (int column = 0; column < kWidthPx; ++column) {
      rgb.bytes.push_back(std::uint8_t(40 + 3 * column));
      rgb.bytes.push_back(std::uint8_t(220 - 4 * row));
      rgb.bytes.push_back(std::uint8_t(128 + 60 * std::sin((row + column) * std::numbers::pi / 45)));
    }
  }
  return rgb;
}

Jpeg encoded(int sampling) {
  struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
  };
  const Image rgb = image();
  const std::unique_ptr<void, Destroy> encoder(tjInitCompress());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(encoder.get(), rgb.bytes.data(), kWidthPx, 0, kHeightPx, TJPF_RGB, &bytes, &size, sampling, 95,
                        TJFLAG_ACCURATEDCT),
            0);
  Jpeg jpeg(bytes, bytes + size);
  tjFree(bytes);
  return jpeg;
}

Result<Image> decoded(const Jpeg& jpeg, int width_px = kWidthPx, int height_px = kHeightPx) {
  return to_rgb8(Image{width_px, height_px, PixelFormat::kMjpeg, jpeg});
}

void expect_near(const Image& a, const Image& b) {
  ASSERT_EQ(a.bytes.size(), b.bytes.size());
  int most = 0;
  double sum = 0;
  for (std::size_t i = 0; i < a.bytes.size(); ++i) {
    const int off = std::abs(a.bytes[i] - b.bytes[i]);
    most = std::max(most, off);
    sum += off;
  }
  EXPECT_LE(most, kJpegOff);
  EXPECT_LE(sum / double(a.bytes.size()), kMeanOff);
}

/// Returns `jpeg` without the segments of `marker`.
Jpeg without(std::uint8_t marker, const Jpeg& jpeg) {
  constexpr std::uint8_t kStartOfScan = 0xDA;
  Jpeg left(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  while (jpeg[at + 1] != kStartOfScan) {
    const std::size_t length = 2 + 256 * std::size_t(jpeg[at + 2]) + jpeg[at + 3];
    if (jpeg[at + 1] != marker) {
      left.insert(left.end(), jpeg.begin() + std::ptrdiff_t(at), jpeg.begin() + std::ptrdiff_t(at + length));
    }
    at += length;
  }
  left.insert(left.end(), jpeg.begin() + std::ptrdiff_t(at), jpeg.end());
  return left;
}

struct Sampling {
  const char* name;
  int code;
};
void PrintTo(const Sampling& sampling, std::ostream* os) { *os << sampling.name; }

class JpegToRgb8 : public testing::TestWithParam<Sampling> {};

TEST_P(JpegToRgb8, ShowsWhatWasEncoded) {
  const auto rgb = decoded(encoded(GetParam().code));
  ASSERT_TRUE(rgb) << rgb.error().message;
  EXPECT_EQ(rgb->format, PixelFormat::kRgb8);
  expect_near(*rgb, image());
}

// Catches a decoder that fills the missing part with grey and reports nothing.
TEST_P(JpegToRgb8, RefusesAnImageTruncatedAnywhere) {
  const Jpeg whole = encoded(GetParam().code);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto rgb = decoded(Jpeg(whole.begin(), whole.begin() + std::ptrdiff_t(size)));
    ASSERT_FALSE(rgb) << "of " << whole.size() << " bytes, the first " << size;
    ASSERT_EQ(rgb.error().code, ErrorCode::kBadData);
  }
}

INSTANTIATE_TEST_SUITE_P(Samplings, JpegToRgb8,
                         testing::Values(Sampling{"s444", TJSAMP_444}, Sampling{"s422", TJSAMP_422},
                                         Sampling{"s420", TJSAMP_420}),
                         [](const auto& sampling) { return sampling.param.name; });

TEST(JpegToRgb8, ShowsGreyInAllChannels) {
  const auto rgb = decoded(encoded(TJSAMP_GRAY));
  ASSERT_TRUE(rgb) << rgb.error().message;
  const Image colours = image();
  for (std::size_t i = 0; i < rgb->bytes.size(); i += 3) {
    ASSERT_EQ(rgb->bytes[i], rgb->bytes[i + 1]);
    ASSERT_EQ(rgb->bytes[i], rgb->bytes[i + 2]);
    const double light = 0.299 * colours.bytes[i] + 0.587 * colours.bytes[i + 1] + 0.114 * colours.bytes[i + 2];
    ASSERT_NEAR(rgb->bytes[i], light, kJpegOff);
  }
}

// Many cameras leave out the Huffman tables, because they are always the same.
TEST(JpegToRgb8, KnowsTheTablesThatCamerasLeaveOut) {
  constexpr std::uint8_t kHuffmanTables = 0xC4;
  const Jpeg whole = encoded(TJSAMP_422);
  const Jpeg bare = without(kHuffmanTables, whole);
  ASSERT_LT(bare.size(), whole.size());
  const auto rgb = decoded(bare);
  ASSERT_TRUE(rgb) << rgb.error().message;
  expect_near(*rgb, image());
}

TEST(ToMjpeg, ComesBackNearlyAsItWas) {
  const auto jpeg = to_mjpeg(image(), 95);
  ASSERT_TRUE(jpeg) << jpeg.error().message;
  EXPECT_EQ(jpeg->format, PixelFormat::kMjpeg);
  const auto rgb = to_rgb8(*jpeg);
  ASSERT_TRUE(rgb) << rgb.error().message;
  expect_near(*rgb, image());
  EXPECT_LT(to_mjpeg(image(), 30)->bytes.size(), jpeg->bytes.size());
}

TEST(ToMjpeg, RefusesAnImageThatLacksPixels) {
  Image cut = image();
  cut.bytes.resize(cut.bytes.size() - 1);
  EXPECT_THAT(to_mjpeg(cut, 95), FailsWith(ErrorCode::kBadData));
}

// A buffer of constant size holds other bytes after the image.
TEST(JpegToRgb8, IgnoresBytesAfterTheImage) {
  Jpeg padded = encoded(TJSAMP_422);
  padded.resize(padded.size() + 1000);
  EXPECT_TRUE(decoded(padded));
}

TEST(JpegToRgb8, RefusesAnotherSize) {
  const Jpeg jpeg = encoded(TJSAMP_420);
  for (const auto& [width_px, height_px] :
       {std::pair(kWidthPx + 1, kHeightPx), std::pair(kWidthPx, kHeightPx - 1), std::pair(kHeightPx, kWidthPx)}) {
    EXPECT_THAT(decoded(jpeg, width_px, height_px), FailsWith(ErrorCode::kBadData, HasSubstr("53 x 37")));
  }
  for (const auto& [width_px, height_px] : {std::pair(0, 0), std::pair(-kWidthPx, -kHeightPx)}) {
    EXPECT_THAT(decoded(jpeg, width_px, height_px), FailsWith(ErrorCode::kBadData));
  }
}

TEST(JpegToRgb8, RefusesADamagedImage) {
  const Jpeg whole = encoded(TJSAMP_422);
  // One image has a marker in the middle of its data, where none is allowed; another one lost a packet.
  Jpeg marker = whole;
  marker[whole.size() - 300] = 0xFF;
  marker[whole.size() - 299] = 0xC4;
  Jpeg gap = whole;
  gap.erase(gap.end() - 400, gap.end() - 200);
  Jpeg no_start = whole;
  no_start[1] = 0;
  for (const Jpeg& bad : {marker, gap, no_start, Jpeg(5000, 0x55), Jpeg{}}) {
    EXPECT_THAT(decoded(bad), FailsWith(ErrorCode::kBadData, HasSubstr(std::to_string(bad.size()))))
        << bad.size() << " bytes of " << whole.size();
  }
}

}  // namespace
}  // namespace twocone
