// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2_camera/loopback.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/v4l2_camera/v4l2_camera.h"

namespace twocone::v4l2 {
namespace {

using testing::HasSubstr;

// What a device does with images is tried in a virtual machine: tests/vm/loopback.sh.
TEST(Loopback, ADeviceThatIsNoneIsRefused) {
  if (!why_not().empty()) {
    EXPECT_EQ(open_loopback("/dev/video10").error().code, ErrorCode::kUnavailable);
    return;
  }
  const auto missing = open_loopback("/dev/no_video");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("modprobe v4l2loopback"));
  const auto other = open_loopback("/dev/null");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kRefused);
  EXPECT_THAT(other.error().message, HasSubstr("/dev/null: it accepts no images"));
}

}  // namespace
}  // namespace twocone::v4l2
