// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "drivers/v4l2_camera/v4l2_camera.h"
#include "tests/drivers/camera_conformance.h"

#include "tests/drivers/scripted_kernel.h"

namespace twocone::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

OpenedCamera open_scripted(ScriptedDevice device) {
  auto kernel = std::make_shared<ScriptedKernel>();
  device.runs = true;
  kernel->add(std::move(device));
  auto camera = v4l2::open_camera({"/dev/video0", "", {}}, kernel);
  if (!camera) throw std::runtime_error(camera.error().message);
  return {*std::move(camera), [](nanoseconds time) { std::this_thread::sleep_for(time); }};
}

void to_even(std::uint32_t /*format*/, std::uint32_t& width, std::uint32_t& height) {
  width &= ~1U;
  height &= ~1U;
}

// The unit of a buffer's time is a microsecond.
constexpr auto kStampJitter = 1us;

const CameraCase kLent{"V4l2Lent", {64, 48, 60}, kStampJitter, [] {
                         return open_scripted({.formats = {V4L2_PIX_FMT_YUYV}, .adjust = to_even});
                       }};
const CameraCase kPacked{"V4l2PackedPlanes", {64, 48, 60}, kStampJitter, [] {
                           return open_scripted({.can = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING,
                                                 .formats = {V4L2_PIX_FMT_NV12},
                                                 .adjust = to_even,
                                                 .row_padding = 10});
                         }};
const CameraCase kFewBuffers{
    "V4l2FewBuffers", {64, 48, 60}, kStampJitter, [] {
      return open_scripted({.formats = {V4L2_PIX_FMT_RGB24}, .most_buffers = 2, .keeps_mapped_buffers = true});
    }};

INSTANTIATE_TEST_SUITE_P(V4l2, CameraConformance, testing::Values(kLent, kPacked, kFewBuffers), camera_case_name);
INSTANTIATE_TEST_SUITE_P(V4l2, CameraThatDoesNotWait, testing::Values(kLent, kPacked), camera_case_name);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraInLockStep);

}  // namespace
}  // namespace twocone::test
