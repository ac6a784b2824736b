// SPDX-License-Identifier: Apache-2.0
#include "hal/image.h"

#include <thread>

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
