// SPDX-License-Identifier: Apache-2.0
// Tests of faults: each is reported with the right code and in time, and the camera recovers if the device does.
#include <poll.h>

#include <cerrno>
#include <thread>

#include "tests/drivers/v4l2_fixture.h"
#include "tests/support/fails_with.h"

namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using testing::HasSubstr;
using testing_support::FailsWith;

// The delay that a machine with other load may add to a wait.
constexpr auto kSlack = 20s;

class V4l2FaultsTest : public V4l2Test {
 protected:
  void expect_frame() {
    ASSERT_TRUE(kernel_->expose(device_));
    const auto frame = camera_->grab(kPlenty);
    ASSERT_TRUE(frame) << frame.error().message;
  }
};

TEST_F(V4l2FaultsTest, ASecondStreamerIsRefused) {
  auto first = v4l2::open_camera({"/dev/video0", "", {}}, kernel_);
  ASSERT_TRUE(first && (*first)->configure({64, 48, 20}) && (*first)->start());
  ASSERT_TRUE(open());
  EXPECT_THAT(camera_->configure({64, 48, 20}),
              FailsWith(ErrorCode::kRefused, HasSubstr("another program uses the camera")));
  (*first)->stop();
  start();
  EXPECT_EQ(error_of((*first)->start()).code, ErrorCode::kRefused);
}

TEST_F(V4l2FaultsTest, AStartThatFailsAnywhereLeavesNothingAndCanBeTriedAgain) {
  struct Case {
    unsigned long request;
    std::deque<int> errors;
    ErrorCode code;
    const char* part;
  };
  for (const Case& c : {Case{VIDIOC_REQBUFS, {EINVAL}, ErrorCode::kRefused, "its buffers"},
                        Case{VIDIOC_REQBUFS, {EBUSY}, ErrorCode::kRefused, "another program"},
                        Case{VIDIOC_REQBUFS, {ENOMEM}, ErrorCode::kUnavailable, "its buffers"},
                        Case{VIDIOC_QUERYBUF, {0, 0, EINVAL}, ErrorCode::kRefused, "its buffers"},
                        Case{VIDIOC_QBUF, {0, 0, 0, EINVAL}, ErrorCode::kRefused, "handing it a buffer"},
                        Case{VIDIOC_STREAMON, {EINVAL}, ErrorCode::kRefused, "starting its stream"},
                        Case{VIDIOC_STREAMON, {ENOSPC}, ErrorCode::kRefused, "USB bus"},
                        Case{VIDIOC_STREAMON, {EIO}, ErrorCode::kDisconnected, "starting its stream"},
                        Case{VIDIOC_STREAMON, {ENODEV}, ErrorCode::kDisconnected, "starting its stream"}}) {
    SCOPED_TRACE(c.part);
    camera_.reset();
    ASSERT_TRUE(open() && camera_->configure({64, 48, 20}));
    device_.errors[c.request] = c.errors;
    const Error error = error_of(camera_->start());
    EXPECT_EQ(error.code, c.code) << error.message;
    EXPECT_THAT(error.message, HasSubstr(c.part));
    EXPECT_EQ(kernel_->mappings(), 0U);
    EXPECT_EQ(camera_->state(), Camera::State::kConfigured);
    const auto again = camera_->start();
    ASSERT_TRUE(again) << again.error().message;
    expect_frame();
  }
}

TEST_F(V4l2FaultsTest, ADeviceWithOneBufferDoesNotStream) {
  device_.most_buffers = 1;
  ASSERT_TRUE(open() && camera_->configure({64, 48, 20}));
  EXPECT_EQ(error_of(camera_->start()).code, ErrorCode::kUnavailable);
}

TEST_F(V4l2FaultsTest, ADamagedFrameIsReportedOnceAndCountsAsLost) {
  start();
  expect_frame();
  kernel_->expose(device_, {.sequence = 1, .flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_ERROR});
  const Error error = error_of(camera_->grab(kPlenty));
  EXPECT_EQ(error.code, ErrorCode::kBadData);
  EXPECT_THAT(error.message, HasSubstr("frame 1 came damaged"));
  ASSERT_TRUE(kernel_->expose(device_));
  const auto next = camera_->grab(kPlenty);
  ASSERT_TRUE(next) << next.error().message;
  EXPECT_EQ(next->header().sequence, 2U);
  EXPECT_EQ(next->header().lost_before, 1U);
}

// Catches a good frame that is discarded because a damaged one came after it.
TEST_F(V4l2FaultsTest, AGoodFrameBeforeADamagedOneIsKept) {
  start({64, 48, 1});
  ASSERT_TRUE(kernel_->expose(device_));
  ASSERT_TRUE(kernel_->expose(device_));
  kernel_->expose(device_, {.sequence = 2, .flags = V4L2_BUF_FLAG_ERROR});
  EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kBadData);
  const auto frame = camera_->grab(kPlenty);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->header().sequence, 1U);
  EXPECT_EQ(frame->header().skipped_before, 1U);
}

TEST_F(V4l2FaultsTest, AFrameCutShortIsBadData) {
  start();
  kernel_->expose(device_, {.sequence = 0, .bytes = 2 * 64 * 48 - 1});
  EXPECT_THAT(camera_->grab(kPlenty), FailsWith(ErrorCode::kBadData, HasSubstr("6143 bytes instead of 6144")));
  expect_frame();
  EXPECT_EQ(kernel_->queued(device_), 6U) << "its buffer went back";
}

TEST_F(V4l2FaultsTest, ABrokenStreamIsDisconnectedUntilItIsSetUpAgain) {
  struct Case {
    const char* name;
    int poll_events;
    int dequeue_error;
  };
  for (const Case& c :
       {Case{"POLLERR", POLLERR, 0}, Case{"POLLHUP", POLLHUP, 0}, Case{"POLLERR and EIO", POLLERR, EIO},
        Case{"ENODEV", 0, ENODEV}, Case{"EIO", 0, EIO}, Case{"EINVAL", 0, EINVAL}, Case{"ENOMEM", 0, ENOMEM}}) {
    SCOPED_TRACE(c.name);
    start();
    expect_frame();
    device_.poll_events = c.poll_events;
    if (c.dequeue_error != 0) device_.errors[VIDIOC_DQBUF] = {c.dequeue_error};
    const auto asked = steady_clock::now();
    EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kDisconnected);
    EXPECT_LT(steady_clock::now() - asked, kPlenty) << "it must be reported when it happens";
    device_.poll_events = 0;
    const int opened = kernel_->count(VIDIOC_QUERYCAP);
    camera_->stop();
    EXPECT_EQ(kernel_->files_held(), 0U);
    start();
    EXPECT_EQ(kernel_->count(VIDIOC_QUERYCAP), opened + 1);
    expect_frame();
    camera_->stop();
  }
}

// Catches an endless loop after a poll() that reports "readable and broken".
TEST_F(V4l2FaultsTest, AFrameBeforeTheBreakIsReturned) {
  start();
  ASSERT_TRUE(kernel_->expose(device_));
  device_.poll_events = POLLERR | POLLIN;
  EXPECT_TRUE(camera_->grab(kPlenty));
  EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kDisconnected);
}

TEST_F(V4l2FaultsTest, AnUnplugIsDisconnectedAndItComesBack) {
  for (int round = 0; round < 3; ++round) {
    start();
    expect_frame();
    kernel_->unplug(device_);
    EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kDisconnected);
    EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kDisconnected) << "every call must report it";
    camera_->stop();
    device_.open_error = ENOENT;
    EXPECT_EQ(error_of(camera_->configure({64, 48, 20})).code, ErrorCode::kDisconnected);
    device_.open_error = 0;
  }
}

TEST_F(V4l2FaultsTest, SilenceIsATimeoutEvenIfTheCallersIsLonger) {
  start({64, 48, 25});
  expect_frame();
  const auto asked = steady_clock::now();
  EXPECT_THAT(camera_->grab(kPlenty + kSlack), FailsWith(ErrorCode::kTimeout, HasSubstr("no frame for 500 ms")));
  EXPECT_GE(steady_clock::now() - asked, 500ms);
  EXPECT_LT(steady_clock::now() - asked, kSlack);
  expect_frame();
  EXPECT_THAT(error_of(camera_->grab(5ms)).message, HasSubstr("no frame within 5 ms"));
}

TEST_F(V4l2FaultsTest, TheFirstFrameMayTakeLonger) {
  start();
  std::thread later([&] {
    std::this_thread::sleep_for(800ms);
    kernel_->expose(device_);
  });
  const auto frame = camera_->grab(kPlenty);
  later.join();
  EXPECT_TRUE(frame) << frame.error().message;
}

TEST_F(V4l2FaultsTest, AFaultAtTheInputIsReported) {
  start({64, 48, 25});
  expect_frame();
  for (const auto& [status, part] :
       {std::pair{V4L2_IN_ST_NO_SIGNAL, "no signal"}, std::pair{V4L2_IN_ST_NO_SYNC, "no lock"},
        std::pair{V4L2_IN_ST_NO_POWER, "no power"}}) {
    device_.input_status = std::uint32_t(status);
    EXPECT_THAT(camera_->grab(kPlenty), FailsWith(ErrorCode::kTimeout, HasSubstr(part)));
  }
}

// Catches images without content that are returned as if the source were connected.
TEST_F(V4l2FaultsTest, ASourceThatIsCutOffIsATimeoutAlthoughTheDeviceStillSends) {
  device_.reports_source_changes = true;
  device_.runs = true;
  start({64, 48, 50});
  ASSERT_TRUE(camera_->grab(kPlenty));
  device_.input_status = V4L2_IN_ST_NO_SIGNAL;
  device_.source_changes = 2;
  EXPECT_THAT(camera_->grab(kPlenty), FailsWith(ErrorCode::kTimeout, HasSubstr("no signal")));

  device_.input_status = 0;
  device_.source_changes = 1;
  EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kDisconnected) << "it may have another size";
  camera_->stop();
  start({64, 48, 50});
  EXPECT_TRUE(camera_->grab(kPlenty));

  device_.input_status = V4L2_IN_ST_NO_SIGNAL;
  camera_->stop();
  start({64, 48, 50});
  EXPECT_EQ(error_of(camera_->grab(kPlenty)).code, ErrorCode::kTimeout) << "the source is cut off before the start";
}

// Catches a stream that loses one buffer with each refusal until none is left.
TEST_F(V4l2FaultsTest, ABufferThatIsNotAcceptedIsOfferedAgain) {
  start();
  for (int i = 0; i < 20; ++i) {
    device_.errors[VIDIOC_QBUF] = {EINVAL};
    expect_frame();
  }
  expect_frame();
  EXPECT_EQ(kernel_->queued(device_), 6U);
}

TEST_F(V4l2FaultsTest, ASignalDoesNotEndTheWait) {
  start();
  device_.poll_interrupts = 3;
  std::thread later([&] {
    std::this_thread::sleep_for(10ms);
    kernel_->expose(device_);
  });
  const auto frame = camera_->grab(kPlenty);
  later.join();
  EXPECT_TRUE(frame) << frame.error().message;
}

// Old kernels do not release buffers that are mapped; nor does a device that is gone.
TEST_F(V4l2FaultsTest, ADeviceThatKeepsItsBuffersIsOpenedAgain) {
  start();
  device_.errors[VIDIOC_REQBUFS] = {EBUSY};
  camera_->stop();
  EXPECT_EQ(kernel_->files_held(), 0U);
  ASSERT_TRUE(camera_->start());
  expect_frame();
}

}  // namespace
}  // namespace twocone::test
