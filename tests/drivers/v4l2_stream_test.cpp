// SPDX-License-Identifier: Apache-2.0
// Tests of the frames of a stream: which ones are returned, their numbers and times, and the owners of their buffers.
#include <atomic>
#include <thread>
#include <vector>

#include "tests/drivers/v4l2_fixture.h"

namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using std::chrono::steady_clock;

constexpr std::uint64_t kBuffers = 6;

class V4l2StreamTest : public V4l2Test {
 protected:
  void expose(std::uint32_t sequence, nanoseconds captured = now()) {
    kernel_->expose(device_, {.sequence = sequence, .captured = captured, .value = std::uint8_t(sequence)});
  }
  Frame grab() {
    auto frame = camera_->grab(kPlenty);
    if (!frame) {
      ADD_FAILURE() << frame.error().message;
      return Frame({}, Image{});
    }
    return *frame;
  }
  static std::uint8_t first_byte(const Frame& frame) { return (**frame.image(kPlenty)).bytes[0]; }
};

TEST_F(V4l2StreamTest, GapsInTheDevicesNumbersAreLostFrames) {
  start();
  std::vector<std::uint64_t> sequences, lost;
  for (const std::uint32_t sequence : {5U, 6U, 9U, 10U}) {
    expose(sequence);
    const Frame frame = grab();
    sequences.push_back(frame.header().sequence);
    lost.push_back(frame.header().lost_before);
    EXPECT_EQ(frame.header().skipped_before, 0U);
  }
  EXPECT_THAT(sequences, testing::ElementsAre(0, 1, 4, 5));
  EXPECT_THAT(lost, testing::ElementsAre(0, 0, 2, 0));
}

TEST_F(V4l2StreamTest, NumbersContinueWhenThirtyTwoBitsWrap) {
  start();
  std::vector<std::uint64_t> sequences, lost;
  for (const std::uint32_t sequence : {0xFFFF'FFFEU, 0xFFFF'FFFFU, 0U, 3U}) {
    expose(sequence);
    const Frame frame = grab();
    sequences.push_back(frame.header().sequence);
    lost.push_back(frame.header().lost_before);
  }
  EXPECT_THAT(sequences, testing::ElementsAre(0, 1, 2, 5));
  EXPECT_THAT(lost, testing::ElementsAre(0, 0, 0, 2));
}

// Catches a wrong count of four thousand million lost frames.
TEST_F(V4l2StreamTest, ADeviceThatDoesNotCountOrStartsItsCountAgainHasNoLoss) {
  start();
  std::uint64_t expected = 0;
  for (const std::uint32_t sequence : {7U, 7U, 7U, 0U, 1U}) {
    expose(sequence);
    const Frame frame = grab();
    EXPECT_EQ(frame.header().sequence, expected++);
    EXPECT_EQ(frame.header().lost_before, 0U);
  }
}

TEST_F(V4l2StreamTest, ALateReaderGetsTheNewestFrameAndTheNumberOfSkippedOnes) {
  start({64, 48, 1});  // a rate so slow that no frame is stale here
  expose(0);
  EXPECT_EQ(grab().header().lost_before, 0U);
  for (const std::uint32_t sequence : {1U, 2U, 4U, 5U}) expose(sequence);
  const Frame frame = grab();
  EXPECT_EQ(frame.header().sequence, 5U);
  EXPECT_EQ(first_byte(frame), 5);
  EXPECT_EQ(frame.header().lost_before, 4U) << "three frames that arrived, and one that did not";
  EXPECT_EQ(frame.header().skipped_before, 3U);
  expose(6);
  EXPECT_EQ(grab().header().skipped_before, 0U);
}

// Catches a camera that returns the newest of six old frames: if all buffers are full, a device fills none while the
// reader is late.
TEST_F(V4l2StreamTest, ANewestFrameThatIsStaleIsSkippedToo) {
  start();
  const auto long_ago = now() - 1s;
  for (std::uint32_t i = 0; i < kBuffers; ++i) expose(i, long_ago + i * 50ms);
  EXPECT_FALSE(kernel_->expose(device_)) << "the device has a buffer left";
  std::thread later([&] {
    std::this_thread::sleep_for(20ms);
    expose(19);
  });
  const Frame frame = grab();
  later.join();
  EXPECT_EQ(frame.header().sequence, 19U);
  EXPECT_EQ(frame.header().lost_before, 19U);
  EXPECT_EQ(frame.header().skipped_before, kBuffers);
  EXPECT_LT(now() - frame.header().captured.since_zero, kPlenty);
}

TEST_F(V4l2StreamTest, AReaderThatCannotWaitGetsAStaleFrame) {
  start();
  const auto long_ago = now() - 1s;
  for (std::uint32_t i = 0; i < kBuffers; ++i) expose(i, long_ago + i * 50ms);
  const auto frame = camera_->grab(0ms);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->header().sequence, kBuffers - 1);
  EXPECT_EQ(frame->header().captured.since_zero, std::chrono::floor<std::chrono::microseconds>(long_ago + 250ms));
}

// Catches a driver that never returns a frame of a camera behind a slow link, whose frames are all old.
TEST_F(V4l2StreamTest, OldFramesOfADeviceThatHasBuffersLeftAreReturned) {
  start();
  for (std::uint32_t i = 0; i < 3; ++i) {
    expose(i, now() - 1s);
    EXPECT_EQ(grab().header().sequence, i);
  }
}

TEST_F(V4l2StreamTest, CaptureTimesAreTheDevicesIfTheyAreOnTheSteadyClock) {
  start();
  const auto captured = std::chrono::floor<std::chrono::microseconds>(now() - 3ms);
  expose(0, captured);
  const auto header = grab().header();
  EXPECT_EQ(header.captured.since_zero, captured);
  EXPECT_EQ(header.captured.clock, ClockKind::kSteady);
}

TEST_F(V4l2StreamTest, WrongCaptureTimesAreReplacedByTheTimeOfTaking) {
  start();
  struct Case {
    const char* name;
    nanoseconds captured;
    std::uint32_t flags;
  };
  std::uint32_t sequence = 0;
  for (const Case& c : {Case{"of the wall clock, by its flag", now(), V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN},
                        Case{"of the wall clock", std::chrono::system_clock::now().time_since_epoch(),
                             V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC},
                        Case{"zero", 0ns, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC},
                        Case{"before zero", -5s, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC},
                        Case{"near a wrap", std::chrono::seconds(0x7FFF'FF00), V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC}}) {
    SCOPED_TRACE(c.name);
    const auto before = now();
    // On a machine that has run for less than ten seconds, zero is not distinguishable from now.
    const bool is_odd = c.flags != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC || std::chrono::abs(before - c.captured) > 11s;
    kernel_->expose(device_, {.sequence = sequence++, .captured = c.captured, .flags = c.flags});
    const auto captured = grab().header().captured.since_zero;
    if (is_odd) {
      EXPECT_GE(captured, before);
      EXPECT_LE(captured, now());
    }
  }
}

TEST_F(V4l2StreamTest, AFrameLendsItsBufferUntilTheLastCopyIsGone) {
  start();
  EXPECT_EQ(kernel_->queued(device_), kBuffers);
  expose(1);
  auto first = std::make_unique<Frame>(grab());
  EXPECT_EQ(kernel_->queued(device_), kBuffers - 1);
  auto second = std::make_unique<Frame>(*first);
  first.reset();
  EXPECT_EQ(kernel_->queued(device_), kBuffers - 1);
  second.reset();
  EXPECT_EQ(kernel_->queued(device_), kBuffers);
}

TEST_F(V4l2StreamTest, FramesAreCopiesWhenTheDeviceWouldRunOutOfBuffers) {
  start();
  std::vector<Frame> held;
  for (std::uint32_t i = 0; i < 12; ++i) {
    expose(i);
    held.push_back(grab());
    EXPECT_GE(kernel_->queued(device_), 2U) << "frame " << i;
    EXPECT_EQ((**held.back().image(kPlenty)).bytes.is_lent(), i < kBuffers - 2) << "frame " << i;
  }
  for (std::uint32_t i = 0; i < 12; ++i) EXPECT_EQ(first_byte(held[i]), i);
}

TEST_F(V4l2StreamTest, LentFramesOutliveTheStreamAndTheCamera) {
  for (const bool keeps_mapped_buffers : {false, true}) {
    SCOPED_TRACE(keeps_mapped_buffers ? "an old kernel" : "a new kernel");
    device_.keeps_mapped_buffers = keeps_mapped_buffers;
    camera_.reset();
    start();
    expose(77);
    const Frame frame = grab();
    ASSERT_TRUE((**frame.image(kPlenty)).bytes.is_lent());
    const int opened = kernel_->count(VIDIOC_QUERYCAP);
    for (int round = 0; round < 3; ++round) {
      camera_->stop();
      EXPECT_EQ(kernel_->mappings(), 1U) << "only the frame's";
      const auto started = camera_->start();
      ASSERT_TRUE(started) << started.error().message;
      expose(5);
      EXPECT_EQ(first_byte(grab()), 5);
      EXPECT_EQ(first_byte(frame), 77);
    }
    EXPECT_EQ(kernel_->count(VIDIOC_QUERYCAP), opened) << "no need to open it again";
    camera_.reset();
    EXPECT_EQ(kernel_->files_held(), 0U);
    EXPECT_EQ(first_byte(frame), 77);
  }
}

// Catches a held frame that keeps an unplugged device open, so that the device comes back under another name.
TEST_F(V4l2StreamTest, LentFramesDoNotKeepAnUnpluggedDeviceOpen) {
  start();
  expose(77);
  const Frame frame = grab();
  kernel_->unplug(device_);
  EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kDisconnected);
  camera_->stop();
  EXPECT_EQ(kernel_->files_held(), 0U);
  start();
  expose(5);
  EXPECT_EQ(first_byte(grab()), 5);
  EXPECT_EQ(first_byte(frame), 77);
}

TEST_F(V4l2StreamTest, FramesMayBeReleasedByAnyThreadAtAnyTime) {
  device_.runs = true;
  start({64, 48, 500});
  std::mutex mutex;
  std::vector<Frame> shelf;
  std::atomic<bool> done = false;
  std::thread reader([&] {
    while (!done) {
      std::vector<Frame> taken;
      {
        const std::lock_guard lock(mutex);
        taken.swap(shelf);
      }
      for (const Frame& frame : taken) EXPECT_EQ((**frame.image(kPlenty)).bytes.size(), 2U * 64 * 48);
    }
  });
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < 20; ++i) {
      const auto frame = camera_->grab(kPlenty);
      ASSERT_TRUE(frame) << frame.error().message;
      const std::lock_guard lock(mutex);
      shelf.push_back(*frame);
    }
    camera_->stop();
    ASSERT_TRUE(camera_->start());
  }
  camera_.reset();
  done = true;
  reader.join();
}

}  // namespace
}  // namespace twocone::test
