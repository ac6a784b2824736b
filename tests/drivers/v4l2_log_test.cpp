// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <linux/videodev2.h>

#include <cerrno>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/log.h"
#include "drivers/v4l2_camera/device.h"

namespace twocone::v4l2 {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(V4l2Log, NamesTheCallThatFailed) {
  static_cast<void>(base::close_log());  // forgets what other tests left
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  constexpr int kNoFile = -1;
  EXPECT_EQ(real_kernel()->ioctl(kNoFile, VIDIOC_STREAMON, &type), -1);
  EXPECT_EQ(errno, EBADF);
  EXPECT_THAT(
      base::close_log(),
      ElementsAre(HasSubstr("warning v4l2: /proc/self/fd/-1: call 18 of linux/videodev2.h: Bad file descriptor")));
}

// Catches a log that fills up with the questions that a device cannot answer.
TEST(V4l2Log, IsSilentAboutCallsThatADeviceDoesNotHave) {
  static_cast<void>(base::close_log());  // forgets what other tests left
  const auto kernel = real_kernel();
  const int file = kernel->open("/dev/null");
  ASSERT_GE(file, 0);
  v4l2_capability capability{};
  EXPECT_EQ(kernel->ioctl(file, VIDIOC_QUERYCAP, &capability), -1);
  EXPECT_EQ(errno, ENOTTY);
  kernel->close(file);
  EXPECT_THAT(base::close_log(), IsEmpty());
}

}  // namespace
}  // namespace twocone::v4l2
