// SPDX-License-Identifier: Apache-2.0
#include "tests/support/faulty_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/memory/memory.h"
#include "tests/support/error_of.h"
#include "tests/support/fails_with.h"

namespace twocone::testing_support {
namespace {

using namespace std::chrono_literals;
using memory::MemoryCamera;
using memory::test_pattern;
using testing::AllOf;
using testing::HasSubstr;

constexpr CameraSettings kSmall{64, 48, 20};
constexpr std::uint64_t kCameraSeed = 20061;

/// A streaming lock-step camera behind a cable with these faults.
std::unique_ptr<Camera> camera_with(const CameraFaults& faults, std::uint64_t seed = kCameraSeed) {
  auto camera =
      std::make_unique<FaultyCamera>(std::make_unique<MemoryCamera>(std::make_shared<ManualClock>()), faults, seed);
  EXPECT_TRUE(camera->configure(kSmall));
  EXPECT_TRUE(camera->start());
  return camera;
}

/// The image of the same camera without faults.
Image intact(std::uint64_t sequence) { return test_pattern(sequence, kSmall); }

TEST(CameraFaults, EveryBadFieldIsNamed) {
  CameraFaults faults;
  faults.lost_chance = 1.01;
  faults.cut_chance = -0.5;
  faults.late_chance = std::numeric_limits<double>::quiet_NaN();
  faults.delay = -3ms;
  EXPECT_THAT(error_of<std::invalid_argument>([&] { check(faults); }),
              AllOf(HasSubstr("lost_chance is 1.01"), HasSubstr("cut_chance is -0.5"), HasSubstr("late_chance is nan"),
                    HasSubstr("delay is -3 ms")));
  EXPECT_THROW(FaultyCamera(nullptr, {}, kCameraSeed), std::invalid_argument);
  EXPECT_THROW(FaultyCamera(std::make_unique<MemoryCamera>(std::make_shared<ManualClock>()), faults, kCameraSeed),
               std::invalid_argument);
}

TEST(FaultyCamera, ATimeoutLosesNothing) {
  CameraFaults faults;
  faults.timeout_chance = 0.5;
  const auto camera = camera_with(faults);
  std::uint64_t timeouts = 0, frames = 0;
  for (int i = 0; i < 100; ++i) {
    const auto frame = camera->grab(1h);
    if (frame) {
      EXPECT_EQ(frame->header().sequence, frames);
      EXPECT_EQ(frame->header().lost_before, 0U);
      ++frames;
    } else {
      EXPECT_EQ(frame.error().code, ErrorCode::kTimeout);
      ++timeouts;
    }
  }
  EXPECT_GT(timeouts, 0U);
  EXPECT_GT(frames, 0U);
}

// The share of faults must equal the probability. With 2000 grabs its standard deviation is sqrt(0.3 * 0.7 / 2000) =
// 1 %. The seed is fixed; a tolerance of five standard deviations suffices for any seed.
TEST(FaultyCamera, FaultsOccurWithTheirProbability) {
  constexpr int kGrabs = 2000;
  constexpr double kChance = 0.3;
  const double tolerance = 5 * std::sqrt(kChance * (1 - kChance) / kGrabs);
  CameraFaults faults;
  faults.timeout_chance = kChance;
  const auto camera = camera_with(faults);
  int timeouts = 0;
  for (int i = 0; i < kGrabs; ++i) timeouts += camera->grab(0ms).has_value() ? 0 : 1;
  EXPECT_NEAR(static_cast<double>(timeouts) / kGrabs, kChance, tolerance);
}

TEST(FaultyCamera, ALostFrameIsReported) {
  CameraFaults faults;
  faults.lost_chance = 1;
  const auto camera = camera_with(faults);
  for (const std::uint64_t sequence : {1U, 3U, 5U}) {
    const auto frame = camera->grab(1s);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->header().sequence, sequence);
    EXPECT_EQ(frame->header().lost_before, 1U);
    EXPECT_EQ(**frame->image(0ms), intact(sequence)) << "the change of the header left the image unchanged";
  }
}

TEST(FaultyCamera, BadDataLosesAFrameWhichTheNextOneReports) {
  CameraFaults faults;
  faults.bad_data_chance = 0.5;
  const auto camera = camera_with(faults);
  std::uint64_t lost = 0, expected = 0;
  int in_a_row = 0;
  for (int i = 0; i < 60; ++i) {
    const auto frame = camera->grab(1s);
    if (frame) {
      EXPECT_EQ(frame->header().sequence, expected);
      EXPECT_EQ(frame->header().lost_before, lost);
      in_a_row += lost > 1 ? 1 : 0;
      lost = 0;
    } else {
      EXPECT_EQ(frame.error().code, ErrorCode::kBadData);
      ++lost;
    }
    ++expected;
  }
  EXPECT_GT(in_a_row, 0) << "the test must include several losses in a row";
}

TEST(FaultyCamera, ALateFrameComesAfterItsDelay) {
  CameraFaults faults;
  faults.late_chance = 1;
  faults.delay = 30ms;
  const auto camera = camera_with(faults);
  const auto asked = std::chrono::steady_clock::now();
  const auto frame = camera->grab(10s);
  EXPECT_GE(std::chrono::steady_clock::now() - asked, 30ms);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header().sequence, 0U);
}

// The purpose of a late frame: the caller gets kTimeout and then a frame that is no longer the newest.
TEST(FaultyCamera, AFrameLaterThanTheTimeoutComesAtTheNextGrab) {
  const auto clock = std::make_shared<ManualClock>();
  CameraFaults faults;
  faults.late_chance = 1;
  faults.delay = 40ms;
  FaultyCamera camera(std::make_unique<MemoryCamera>(clock), faults, kCameraSeed);
  ASSERT_TRUE(camera.configure(kSmall));
  ASSERT_TRUE(camera.start());
  EXPECT_THAT(camera.grab(1ms), FailsWith(ErrorCode::kTimeout));
  clock->advance(150ms);  // three exposures later
  const auto old = camera.grab(10s);
  ASSERT_TRUE(old);
  EXPECT_EQ(old->header().sequence, 0U);
  const auto newest = camera.grab(10s);
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->header().sequence, 3U);
  EXPECT_EQ(newest->header().lost_before, 2U);
}

TEST(FaultyCamera, AGarbledImageHasItsFullSize) {
  CameraFaults faults;
  faults.garbled_chance = 1;
  const auto camera = camera_with(faults);
  const std::ptrdiff_t row_bytes = 3 * kSmall.width_px;
  std::set<int> first_rows;
  for (std::uint64_t i = 0; i < 20; ++i) {
    SCOPED_TRACE(testing::Message() << "frame " << i);
    const auto frame = camera->grab(1s);
    ASSERT_TRUE(frame);
    const auto image = frame->image(0ms);
    ASSERT_TRUE(image);
    EXPECT_TRUE(to_rgb8(**image));
    const Image good = intact(i);
    ASSERT_EQ((*image)->bytes.size(), good.bytes.size());
    std::vector<int> bad_rows;
    for (int row = 0; row < kSmall.height_px; ++row) {
      const auto from = good.bytes.begin() + row * row_bytes;
      if (!std::equal(from, from + row_bytes, (*image)->bytes.begin() + row * row_bytes)) bad_rows.push_back(row);
    }
    ASSERT_FALSE(bad_rows.empty());
    EXPECT_LE(bad_rows.size(), std::size_t(kSmall.height_px / 4));
    EXPECT_EQ(bad_rows.back() - bad_rows.front() + 1, std::ssize(bad_rows)) << "the bad rows are contiguous";
    first_rows.insert(bad_rows.front());
  }
  EXPECT_GT(first_rows.size(), 5U) << "the bad rows must be in different places";
}

TEST(FaultyCamera, ACutImageIsBadDataToItsReader) {
  CameraFaults faults;
  faults.cut_chance = 1;
  const auto camera = camera_with(faults);
  for (int i = 0; i < 20; ++i) {
    const auto frame = camera->grab(1s);
    ASSERT_TRUE(frame);
    const auto image = frame->image(0ms);
    ASSERT_TRUE(image);
    EXPECT_THAT(to_rgb8(**image), FailsWith(ErrorCode::kBadData));
  }
}

TEST(FaultyCamera, ACableThatCameOffStaysOffUntilTheCameraIsOpenedAgain) {
  CameraFaults faults;
  faults.disconnect_after = 3;
  const auto camera = camera_with(faults);
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(camera->grab(1s)) << "round " << round << ", grab " << i;
    for (int i = 0; i < 3; ++i) {
      EXPECT_THAT(camera->grab(1s), FailsWith(ErrorCode::kDisconnected)) << "round " << round << ", grab " << i;
    }
    camera->stop();
    ASSERT_TRUE(camera->start());
  }
}

/// For every grab: the sequence number, or minus one minus the error code; and whether the image is intact.
std::vector<std::pair<int, bool>> history_of(const CameraFaults& faults, std::uint64_t seed) {
  const auto camera = camera_with(faults, seed);
  std::vector<std::pair<int, bool>> history;
  for (int i = 0; i < 200; ++i) {
    const auto frame = camera->grab(1s);
    if (!frame) {
      history.emplace_back(-1 - static_cast<int>(frame.error().code), false);
      continue;
    }
    const auto sequence = frame->header().sequence;
    history.emplace_back(static_cast<int>(sequence), **frame->image(0ms) == intact(sequence));
  }
  return history;
}

// A bug that a bad cable revealed must be reproducible.
TEST(FaultyCamera, TheSeedRepeatsTheFaults) {
  CameraFaults faults;
  faults.timeout_chance = faults.bad_data_chance = faults.lost_chance = faults.garbled_chance = faults.cut_chance = 0.2;
  EXPECT_EQ(history_of(faults, 5), history_of(faults, 5));
  EXPECT_NE(history_of(faults, 5), history_of(faults, 6));
}

// Catches faults that share one random number (they would always occur together), and numbers drawn only when needed
// (switching one fault on would shift all others, and no two runs could be compared).
TEST(FaultyCamera, FaultsAreIndependent) {
  CameraFaults timeouts, both;
  timeouts.timeout_chance = both.timeout_chance = 0.5;
  both.garbled_chance = 0.5;
  const auto alone = history_of(timeouts, 7), together = history_of(both, 7);
  int whole = 0, garbled = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(together[i].first, alone[i].first) << "grab " << i;
    if (together[i].first >= 0) ++(together[i].second ? whole : garbled);
  }
  EXPECT_GT(whole, 0);
  EXPECT_GT(garbled, 0);
}

}  // namespace
}  // namespace twocone::testing_support
