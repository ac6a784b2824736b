// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <array>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/hal/scripted_devices.h"
#include "tests/support/fails_with.h"

namespace twocone {
namespace {

using namespace std::chrono_literals;
using test::small_image;
using testing::AllOf;
using testing::HasSubstr;
using testing_support::FailsWith;

// ---- bytes

/// A driver's buffer, with a flag for whether it was given back.
struct Buffer {
  std::array<std::uint8_t, 3> memory{7, 8, 9};
  bool is_back = false;

  Bytes lend() {
    return Bytes::lent(memory, {memory.data(), [this](const void*) { is_back = true; }});
  }
};

TEST(Bytes, OwnBytesAreAVector) {
  const std::vector<std::uint8_t> vector{1, 2, 3};
  Bytes bytes = vector;
  EXPECT_FALSE(bytes.is_lent());
  EXPECT_EQ(bytes, Bytes(vector.begin(), vector.end()));
  bytes.push_back(4);
  bytes.resize(5);
  bytes[0] = 9;
  EXPECT_EQ(bytes, (Bytes{9, 2, 3, 4, 0}));
  bytes = Bytes(vector.begin(), vector.begin() + 1);
  EXPECT_EQ(bytes, Bytes{1});
  EXPECT_FALSE(bytes.empty());
  EXPECT_TRUE(Bytes().empty());
}

// Catches an unnecessary copy: lent bytes are read in the driver's memory.
TEST(Bytes, LentBytesAreReadInPlace) {
  Buffer buffer;
  const Bytes bytes = buffer.lend();
  EXPECT_TRUE(bytes.is_lent());
  EXPECT_EQ(bytes.data(), buffer.memory.data());
  EXPECT_EQ(bytes.size(), 3u);
  EXPECT_EQ(bytes[2], 9);
  EXPECT_EQ(bytes, (Bytes{7, 8, 9})) << "the owner is not part of the value";
  EXPECT_NE(bytes, (Bytes{7, 8}));
}

TEST(Bytes, LentBytesGoBackWithTheLastCopy) {
  Buffer buffer;
  {
    Bytes kept;
    {
      const Bytes bytes = buffer.lend();
      kept = bytes;
    }
    EXPECT_FALSE(buffer.is_back) << "a copy is still in use";
    EXPECT_EQ(std::as_const(kept).data(), buffer.memory.data());
    const Bytes moved = std::move(kept);
    EXPECT_FALSE(buffer.is_back) << "moved, not given back";
    EXPECT_EQ(moved.size(), 3u);
  }
  EXPECT_TRUE(buffer.is_back);
}

// Catches a write into the device's memory, and a buffer that is not given back although it is no longer in use.
TEST(Bytes, AWriteMakesACopy) {
  Buffer buffer;
  Bytes bytes = buffer.lend();
  bytes[1] = 0;
  EXPECT_FALSE(bytes.is_lent());
  EXPECT_TRUE(buffer.is_back);
  EXPECT_EQ(bytes, (Bytes{7, 0, 9}));
  EXPECT_EQ(buffer.memory[1], 8);
}

TEST(Bytes, AWriteLeavesOtherCopiesUnchanged) {
  Buffer buffer;
  const Bytes other = buffer.lend();
  Bytes bytes = other;
  bytes.push_back(10);
  EXPECT_FALSE(buffer.is_back);
  EXPECT_TRUE(other.is_lent());
  EXPECT_EQ(other, (Bytes{7, 8, 9}));
  EXPECT_EQ(bytes, (Bytes{7, 8, 9, 10}));
}

TEST(Bytes, ReplacedBytesGoBack) {
  Buffer buffer;
  Bytes bytes = buffer.lend();
  bytes = {1};
  EXPECT_TRUE(buffer.is_back);
  EXPECT_FALSE(bytes.is_lent());
  EXPECT_EQ(bytes, Bytes{1});
}

TEST(Bytes, MovedFromAreEmpty) {
  Buffer buffer;
  Bytes lent = buffer.lend();
  Bytes own{1, 2};
  const Bytes elsewhere[] = {std::move(lent), std::move(own)};
  EXPECT_TRUE(lent.empty());  // NOLINT(bugprone-use-after-move): this use is the purpose of the test
  EXPECT_TRUE(own.empty());   // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(elsewhere[0].size() + elsewhere[1].size(), 5u);
}

// ---- formats

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

// ---- frames

// This is far longer than a loaded machine needs to wake a thread, and far shorter than the test's own time limit.
constexpr auto kLong = 10s;

TEST(Frame, WithPixelsPresentNeedsNoWaiting) {
  const Frame frame({5, {ClockKind::kSimulated, 40ms}, 2}, small_image(11));
  EXPECT_EQ(frame.header().sequence, 5U);
  EXPECT_EQ(frame.header().captured.since_zero, 40ms);
  EXPECT_EQ(frame.header().lost_before, 2U);
  const auto image = frame.image(0ms);
  ASSERT_TRUE(image);
  EXPECT_EQ(**image, small_image(11));
}

TEST(Frame, TimesOutBeforeThePixelsArriveAndSucceedsLater) {
  std::promise<ImageResult> pixels;
  const Frame frame({31, {}, 0}, pixels.get_future().share());
  const auto asked = std::chrono::steady_clock::now();
  const auto early = frame.image(20ms);
  EXPECT_GE(std::chrono::steady_clock::now() - asked, 20ms);
  EXPECT_THAT(early, FailsWith(ErrorCode::kTimeout, AllOf(HasSubstr("frame 31"), HasSubstr("20 ms"))));

  pixels.set_value(std::make_shared<const Image>(small_image()));
  EXPECT_TRUE(frame.image(0ms));
}

TEST(Frame, PassesOnTheErrorOfTheBackend) {
  std::promise<ImageResult> pixels;
  const Frame frame({}, pixels.get_future().share());
  pixels.set_value(Error{ErrorCode::kUnavailable, "the renderer died"});
  for (int asked = 0; asked < 2; ++asked) {
    EXPECT_THAT(frame.image(0ms), FailsWith(ErrorCode::kUnavailable, "the renderer died")) << "asked " << asked;
  }
}

// Catches a copy that copies pixels: a frame goes to the recorder, the display and the vision at the same time.
TEST(Frame, CopiesShareThePixels) {
  auto original = std::make_unique<Frame>(Frame::Header{}, small_image());
  const Frame copy = *original;
  const auto of_original = original->image(0ms);
  original.reset();
  const auto of_copy = copy.image(0ms);
  ASSERT_TRUE(of_original);
  ASSERT_TRUE(of_copy);
  EXPECT_EQ(of_original->get(), of_copy->get());
}

// Under ThreadSanitizer, this test catches two threads that wait on one shared_future object.
TEST(Frame, IsWaitedForFromTwoThreads) {
  std::promise<ImageResult> pixels;
  const Frame frame({}, pixels.get_future().share());
  const Image* seen[2] = {nullptr, nullptr};
  {
    std::jthread first([&] {
      if (auto image = frame.image(kLong)) seen[0] = image->get();
    });
    std::jthread second([&] {
      if (auto image = frame.image(kLong)) seen[1] = image->get();
    });
    std::this_thread::sleep_for(5ms);  // both are then likely to be waiting already; the test is valid either way
    pixels.set_value(std::make_shared<const Image>(small_image()));
  }
  EXPECT_NE(seen[0], nullptr);
  EXPECT_EQ(seen[0], seen[1]);
}

}  // namespace
}  // namespace twocone
