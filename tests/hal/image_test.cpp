// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fails_with.h"

namespace twocone {
namespace {

using testing::HasSubstr;
using testing_support::FailsWith;

// The image is not square and no two bytes are equal, so that swapped sides, rows or channels are detected.
const Image kRgb{3, 2, PixelFormat::kRgb8, {1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14, 15, 16, 17, 18, 19}};

TEST(ToRgb8, LeavesRgbAlone) {
  const auto rgb = to_rgb8(kRgb);
  ASSERT_TRUE(rgb);
  EXPECT_EQ(*rgb, kRgb);
}

TEST(ToRgb8, SwapsRedAndBlueOfBgr) {
  Image bgr = kRgb;
  bgr.format = PixelFormat::kBgr8;
  bgr.bytes = {3, 2, 1, 6, 5, 4, 9, 8, 7, 13, 12, 11, 16, 15, 14, 19, 18, 17};
  const auto rgb = to_rgb8(bgr);
  ASSERT_TRUE(rgb);
  EXPECT_EQ(*rgb, kRgb);
}

TEST(ToRgb8, RepeatsGreyInAllChannels) {
  const auto rgb = to_rgb8(Image{3, 1, PixelFormat::kGrey8, {0, 128, 255}});
  ASSERT_TRUE(rgb);
  EXPECT_EQ(*rgb, (Image{3, 1, PixelFormat::kRgb8, {0, 0, 0, 128, 128, 128, 255, 255, 255}}));
}

struct BadImage {
  const char* name;
  Image image;
};
void PrintTo(const BadImage& bad, std::ostream* os) { *os << bad.name; }

class ToRgb8Refuses : public testing::TestWithParam<BadImage> {};

// Catches a conversion that trusts the header and reads past the bytes that arrived over a bad cable.
TEST_P(ToRgb8Refuses, WithTheNumbersInTheMessage) {
  const Image& image = GetParam().image;
  for (const std::string& number : {std::to_string(image.width_px), std::to_string(image.height_px),
                                    std::to_string(image.bytes.size()), std::string(to_string(image.format))}) {
    EXPECT_THAT(to_rgb8(image), FailsWith(ErrorCode::kBadData, HasSubstr(number)));
  }
}

std::vector<std::uint8_t> bytes(std::size_t count) { return std::vector<std::uint8_t>(count, 9); }

INSTANTIATE_TEST_SUITE_P(Images, ToRgb8Refuses,
                         testing::Values(BadImage{"OneByteShort", {3, 2, PixelFormat::kRgb8, bytes(17)}},
                                         BadImage{"OneByteLong", {3, 2, PixelFormat::kBgr8, bytes(19)}},
                                         BadImage{"NoBytes", {3, 2, PixelFormat::kGrey8, {}}},
                                         BadImage{"GreyBytesForColour", {3, 2, PixelFormat::kRgb8, bytes(6)}},
                                         BadImage{"NoWidth", {0, 2, PixelFormat::kRgb8, {}}},
                                         BadImage{"NoHeight", {3, 0, PixelFormat::kRgb8, {}}},
                                         // The product of the two negative sides matches the number of bytes.
                                         BadImage{"NegativeSides", {-3, -2, PixelFormat::kRgb8, bytes(18)}},
                                         BadImage{"ProductPastInt", {65536, 65536, PixelFormat::kGrey8, bytes(1)}}),
                         [](const auto& bad) { return bad.param.name; });

TEST(PixelFormat, NamesAndSizes) {
  EXPECT_EQ(to_string(PixelFormat::kRgb8), "rgb8");
  EXPECT_EQ(to_string(PixelFormat::kBgr8), "bgr8");
  EXPECT_EQ(to_string(PixelFormat::kGrey8), "grey8");
  EXPECT_EQ(image_bytes(PixelFormat::kRgb8, 6, 4), 72u);
  EXPECT_EQ(image_bytes(PixelFormat::kBgr8, 6, 4), 72u);
  EXPECT_EQ(image_bytes(PixelFormat::kGrey8, 6, 4), 24u);
  EXPECT_EQ(image_bytes(PixelFormat::kYuyv, 6, 4), 48u);
  EXPECT_EQ(image_bytes(PixelFormat::kNv12, 6, 4), 36u);
  EXPECT_EQ(image_bytes(PixelFormat::kNv12, 6, 3), std::nullopt);
  EXPECT_EQ(image_bytes(PixelFormat::kUyvy, 5, 4), std::nullopt);
  EXPECT_EQ(image_bytes(PixelFormat::kMjpeg, 6, 4), std::nullopt) << "it depends on the content";
  EXPECT_EQ(image_bytes(PixelFormat::kRgb8, 0, 4), std::nullopt);
}

}  // namespace
}  // namespace twocone
