// SPDX-License-Identifier: Apache-2.0
#include "drivers/memory/memory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>

namespace twocone::memory {
namespace {

using namespace std::chrono_literals;

/// The place, 0 .. kMarkPlaces - 1, of the mark in a test pattern; nothing if no pixel is white.
std::optional<int> mark_place(const Image& image) {
  const auto rgb = to_rgb8(image);
  if (!rgb) return std::nullopt;
  // A saturated hue has one channel at 0, so only the mark is bright in all three.
  constexpr std::uint8_t kWhite = 128;
  double x = 0, y = 0;
  bool seen = false;
  for (int row = 0; row < rgb->height_px; ++row) {
    for (int column = 0; column < rgb->width_px; ++column) {
      const std::size_t at = 3 * (std::size_t(row) * std::size_t(rgb->width_px) + std::size_t(column));
      if (std::min({rgb->bytes[at], rgb->bytes[at + 1], rgb->bytes[at + 2]}) < kWhite) continue;
      const double azimuth = std::atan2(row - 0.5 * (rgb->height_px - 1), column - 0.5 * (rgb->width_px - 1));
      x += std::cos(azimuth);
      y += std::sin(azimuth);
      seen = true;
    }
  }
  if (!seen) return std::nullopt;
  const auto place = int(std::lround(std::atan2(y, x) * kMarkPlaces / (2 * std::numbers::pi)));
  return (place + kMarkPlaces) % kMarkPlaces;
}

constexpr CameraSettings kSmall{64, 48, 20};
constexpr auto kPeriod = 50ms;

int mark_of(const Frame& frame) {
  const auto image = frame.image(0ms);
  if (!image) return -1;
  return mark_place(**image).value_or(-1);
}

TEST(TestPattern, MarkIdentifiesTheSequence) {
  // 48 rows is the smallest height that the header promises. Odd sizes have their centre on a pixel, even ones between
  // pixels.
  for (const CameraSettings& size :
       {CameraSettings{48, 48, 1}, CameraSettings{65, 49, 1}, CameraSettings{160, 120, 1}}) {
    for (std::uint64_t sequence = 0; sequence < 2 * kMarkPlaces; ++sequence) {
      const auto place = mark_place(test_pattern(sequence, size));
      ASSERT_TRUE(place.has_value()) << size.width_px << " x " << size.height_px << ", sequence " << sequence;
      ASSERT_EQ(*place, static_cast<int>(sequence % kMarkPlaces)) << size.width_px << " x " << size.height_px;
    }
  }
}

// On the axes the azimuth is known without a formula: right is 0 (red), down is pi/2, as seen by a camera that looks
// up.
TEST(TestPattern, HueIsTheAzimuth) {
  constexpr int kSide = 101, kMiddle = 50;
  const Image image = test_pattern(7, {kSide, kSide, 1});
  ASSERT_EQ(image.bytes.size(), std::size_t(kSide * kSide * 3));
  const auto colour = [&image](int row, int column) {
    const std::uint8_t* at = image.bytes.data() + 3 * (row * kSide + column);
    return std::array<int, 3>{at[0], at[1], at[2]};
  };
  using Rgb = std::array<int, 3>;
  // These are the hues 0, 90, 180 and 270 degrees; 128 is half of 255, rounded.
  EXPECT_EQ(colour(kMiddle, 90), (Rgb{255, 0, 0}));
  EXPECT_EQ(colour(90, kMiddle), (Rgb{128, 255, 0}));
  EXPECT_EQ(colour(kMiddle, 10), (Rgb{0, 255, 255}));
  EXPECT_EQ(colour(10, kMiddle), (Rgb{128, 0, 255}));
}

TEST(TestPattern, OnePixelHasNoAzimuthButAColour) {
  EXPECT_EQ(test_pattern(1, {1, 1, 1}).bytes, (std::vector<std::uint8_t>{255, 0, 0}));
}

TEST(TestPattern, NoMarkIsNoPlace) {
  EXPECT_EQ(mark_place(Image{2, 1, PixelFormat::kGrey8, {100, 100}}), std::nullopt);
  EXPECT_EQ(mark_place(Image{2, 1, PixelFormat::kGrey8, {255}}), std::nullopt) << "bytes are missing";
}

TEST(MemoryCamera, NeedsAClock) { EXPECT_THROW(MemoryCamera(nullptr), std::invalid_argument); }

TEST(MemoryCamera, ShowsTheExposureOfItsHeader) {
  const auto clock = std::make_shared<ManualClock>();
  MemoryCamera camera(clock);
  ASSERT_TRUE(camera.configure(kSmall));
  clock->advance(1234us);  // the start is not at a whole period of the clock
  ASSERT_TRUE(camera.start());
  for (const int waited : {0, 1, 4, 1}) {
    clock->advance(waited * kPeriod);
    const auto frame = camera.grab(0ms);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(mark_of(*frame), static_cast<int>(frame->header().sequence));
    EXPECT_EQ(frame->header().captured, clock->now());
    EXPECT_EQ(frame->header().lost_before, std::uint64_t(waited == 4 ? 3 : 0));
  }
}

// Catches a frame that is due a nanosecond early or late.
TEST(MemoryCamera, ExposesExactlyWhenDue) {
  const auto clock = std::make_shared<ManualClock>();
  MemoryCamera camera(clock);
  ASSERT_TRUE(camera.configure(kSmall));
  ASSERT_TRUE(camera.start());
  ASSERT_TRUE(camera.grab(0ms)) << "the first is due at once";
  const Timestamp first = clock->now();
  clock->advance(kPeriod - 1ns);
  ASSERT_TRUE(camera.grab(0ms));
  EXPECT_EQ(clock->now() - first, kPeriod) << "the grab advances the clock by the last nanosecond";
  clock->advance(kPeriod);
  const auto due = camera.grab(0ms);
  ASSERT_TRUE(due);
  EXPECT_EQ(due->header().sequence, 2U);
  EXPECT_EQ(clock->now() - first, 2 * kPeriod) << "an exposure that is due needs no time";
}

// 1/30 s is not a whole number of nanoseconds: a sum of rounded periods would be off by 36 us after one hour.
TEST(MemoryCamera, DoesNotDrift) {
  const auto clock = std::make_shared<ManualClock>();
  MemoryCamera camera(clock);
  ASSERT_TRUE(camera.configure({1, 1, 30}));
  ASSERT_TRUE(camera.start());
  clock->advance(1h);
  const auto frame = camera.grab(0ms);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header().sequence, 30U * 3600U);
  EXPECT_EQ(frame->header().captured.since_zero, 1h);
}

TEST(MemoryCamera, TwoCamerasOnOneClockRunInLockStep) {
  const auto clock = std::make_shared<ManualClock>();
  MemoryCamera lower(clock), upper(clock);
  for (MemoryCamera* camera : {&lower, &upper}) {
    ASSERT_TRUE(camera->configure({64, 48, 15}));
    ASSERT_TRUE(camera->start());
  }
  for (std::uint64_t i = 0; i < 5; ++i) {
    const auto first = lower.grab(0ms);
    const auto second = upper.grab(0ms);
    ASSERT_TRUE(first);
    ASSERT_TRUE(second);
    EXPECT_EQ(first->header().sequence, i);
    EXPECT_EQ(second->header().sequence, i);
    EXPECT_EQ(first->header().captured, second->header().captured);
    EXPECT_EQ(clock->now(), first->header().captured);
  }
}

TEST(MemoryCamera, StartBeginsAgainWithTheFirstExposure) {
  const auto clock = std::make_shared<ManualClock>();
  MemoryCamera camera(clock);
  ASSERT_TRUE(camera.configure(kSmall));
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(camera.start());
    for (std::uint64_t i = 0; i < 3; ++i) EXPECT_EQ(camera.grab(0ms)->header().sequence, i) << "round " << round;
    camera.stop();
    clock->advance(10 * kPeriod);
  }
}

TEST(MemoryCamera, LimitsImpossibleSettings) {
  MemoryCamera camera(std::make_shared<ManualClock>());
  const auto big = camera.configure({1'000'000, 1'000'000, 1e12});
  ASSERT_TRUE(big);
  EXPECT_EQ(*big, (CameraSettings{kLargestSide_px, kLargestSide_px, kFastest_hz}));
  const auto slow = camera.configure({1, 1, 1e-300});
  ASSERT_TRUE(slow);
  EXPECT_EQ(*slow, (CameraSettings{1, 1, kSlowest_hz}));
}

// ---- the drive

constexpr auto kTimeout = 200ms;

class MemoryDiffDriveTest : public testing::Test {
 protected:
  std::shared_ptr<ManualClock> clock_ = std::make_shared<ManualClock>();
  std::unique_ptr<MemoryDiffDrive> drive_ = std::make_unique<MemoryDiffDrive>(clock_, DriveLimits{10, kTimeout});
  std::shared_ptr<const Wheels> wheels_ = drive_->wheels();
};

TEST_F(MemoryDiffDriveTest, NeedsAClockAndATime) {
  EXPECT_THROW(MemoryDiffDrive(nullptr, DriveLimits{}), std::invalid_argument);
  EXPECT_THROW(MemoryDiffDrive(clock_, DriveLimits{10, 0ns}), std::invalid_argument);
  EXPECT_THROW(Wheels(nullptr, 1s), std::invalid_argument);
}

// Catches a dead-man time that is only approximate: the wheels turn until a nanosecond before it, and are then stopped.
TEST_F(MemoryDiffDriveTest, TheDeadManTimeIsExact) {
  ASSERT_TRUE(drive_->set_speeds({4, -3}));
  clock_->advance(kTimeout - 1ns);
  EXPECT_EQ(wheels_->speeds(), (WheelSpeeds{4, -3}));
  clock_->advance(1ns);
  EXPECT_EQ(wheels_->speeds(), WheelSpeeds{});
  const double left_rad = drive_->read_angles()->left_rad;
  EXPECT_DOUBLE_EQ(left_rad, 4 * 0.2);
  clock_->advance(1h);
  EXPECT_EQ(drive_->read_angles()->left_rad, left_rad);
  EXPECT_DOUBLE_EQ(drive_->read_angles()->right_rad, -3 * 0.2);
}

TEST_F(MemoryDiffDriveTest, AnglesAreTheIntegralOfTheSpeeds) {
  ASSERT_TRUE(drive_->set_speeds({1.5, 2.5}));
  clock_->advance(40ms);
  ASSERT_TRUE(drive_->set_speeds({-6, 0.5}));
  clock_->advance(30ms);
  ASSERT_TRUE(drive_->stop());
  clock_->advance(50ms);
  ASSERT_TRUE(drive_->set_speeds({2, 2}));
  clock_->advance(1s);  // the dead-man rule stops the wheels after 200 ms of it
  const auto angles = drive_->read_angles();
  ASSERT_TRUE(angles);
  EXPECT_DOUBLE_EQ(angles->left_rad, 1.5 * 0.04 - 6 * 0.03 + 2 * 0.2);
  EXPECT_DOUBLE_EQ(angles->right_rad, 2.5 * 0.04 + 0.5 * 0.03 + 2 * 0.2);
  EXPECT_EQ(angles->time, clock_->now());
}

TEST_F(MemoryDiffDriveTest, RecordsItsCommands) {
  ASSERT_TRUE(drive_->set_speeds({1, 2}));
  clock_->advance(30ms);
  ASSERT_TRUE(drive_->set_speeds({40, 20}));
  ASSERT_TRUE(drive_->stop());
  drive_.reset();
  const auto& commands = wheels_->commands();
  ASSERT_EQ(commands.size(), 4U);
  EXPECT_EQ(commands[0].speeds, (WheelSpeeds{1, 2}));
  EXPECT_EQ(commands[0].time.since_zero, 0ns);
  EXPECT_EQ(commands[1].speeds, (WheelSpeeds{10, 5})) << "as applied";
  EXPECT_EQ(commands[1].time.since_zero, 30ms);
  EXPECT_EQ(commands[2].speeds, WheelSpeeds{}) << "stop()";
  EXPECT_EQ(commands[3].speeds, WheelSpeeds{}) << "the destructor";
}

}  // namespace
}  // namespace twocone::memory
